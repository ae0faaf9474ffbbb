"""`rayproof view`: any two images in the report's viewer, as one file that opens from disk."""

from pathlib import Path

from rayproof.reports.commands.output import say
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder


def view(*images: Path, out: Path = Path("view.html")) -> int:
    """Write a page that shows images side by side, swiped, flickering, through each other, and their differences.

    Other files are opened in it, or dropped into it.

    Parameters
    ----------
    images
        EXR, PFM or PNG files; of an EXR every layer. None: a page to drop files into.
    out
        The file to write, ending in .html.

    """
    if out.suffix.lower() not in (".html", ".htm"):
        raise UsageError(f"--out must end in .html, got {out}")
    from rayproof.reports.publish.page.image_page import read_image, write_page

    with told_in_one_line():
        read = [(str(path), read_image(path)) for path in images]
        writable_folder(out.parent)
        write_page(out, read)
    say(f"{out}: {', '.join(map(str, images)) or 'nothing yet; drop files into it'}")
    return 0
