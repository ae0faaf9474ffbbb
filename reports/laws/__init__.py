"""Laws put to a renderer: `limits` says what rounding may do to a relation, `judging` judges one, `asking` asks.

`work` does one law on one case in a worker, `suite` a whole choice of them (`choice`), `publish` writes what was found.
"""
