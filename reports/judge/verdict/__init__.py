"""From the checks of a case to its one verdict and to the items of the specification that are blamed."""
