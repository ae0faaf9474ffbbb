"""`rayproof cache`: list, verify or clear the cache of answers and verdicts."""

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from rayproof.reports.commands.output import say, show_table, write_json
from rayproof.reports.commands.usage import UsageError, told_in_one_line

if TYPE_CHECKING:
    from rayproof.reports.run.cache_store import Item, Store

DAMAGED = 1  # exit code of `verify` if an entry does not match its checksum
COLUMNS = ("used", "kind", "renderer", "version", "scene", "stages", "seconds", "bytes", "key")


def cache(
    what: Literal["list", "verify", "clear"] = "list", *, folder: Path | None = None, json: Path | None = None
) -> int:
    """List, verify or clear the cache of earlier runs: renders of references, and verdicts.

    The renderer under test renders in every run; its cached verdict is reused only for bit-identical images. An entry
    is read only if its checksum matches and if no other user can write to the folder.

    Parameters
    ----------
    what
        list: list all entries, the least recently used first. verify: read all entries, remove damaged ones, and exit
        with 1 if there were any. clear: remove everything.
    folder
        The folder of the cache. Default: RAYPROOF_CACHE if set, or rayproof/answers in the user's cache folder.
    json
        Also write the result to this file.

    """
    from rayproof.reports.run.cache_store import Store, usual_folder

    store = Store(folder or usual_folder())
    with told_in_one_line():
        if what == "verify":
            if store.unused is not None:
                raise UsageError(f"nothing can be verified: {store.unused}")
            return _verify(store, json)
        if what == "clear":
            count, size = store.clear()
            write_json(json, {"folder": str(store.folder), "removed": count, "bytes": size})
            say(f"{count} entries removed, {_mebibytes(size)}, from {store.folder}")
            return 0
        return _list(store, json)


def _list(store: "Store", json: Path | None) -> int:
    items = store.items()
    rows = [_row(item) for item in items]
    size = sum(item.size for item in items)
    write_json(json, {"folder": str(store.folder), "bytes": size, "entries": rows})
    show_table(f"{len(rows)} entries in {store.folder}", [*COLUMNS], [[row[name] for name in COLUMNS] for row in rows])
    say(f"{_mebibytes(size)} in {len(rows)} entries")
    return 0


def _row(item: "Item") -> dict[str, str | float]:
    """Return the row of an entry in the list."""
    about = item.about
    width, height = about.get("size", ("?", "?"))
    return {
        "key": item.path.stem[:12],
        "used": datetime.fromtimestamp(item.used).isoformat(sep=" ", timespec="seconds"),
        "kind": about.get("kind", "unreadable"),
        "renderer": about.get("reference", "?"),
        "version": about.get("version", "?"),
        "scene": f"{width}x{height}, {about.get('shapes', '?')} shapes, {about.get('lights', '?')} lights",
        "stages": len(about.get("stages", ())),
        "seconds": about.get("seconds", "?"),
        "bytes": item.size,
    }


def _verify(store: "Store", json: Path | None) -> int:
    good, bad = store.verify()
    damaged = [{"file": str(path), "why": why} for path, why in bad]
    write_json(json, {"folder": str(store.folder), "good": good, "damaged": damaged})
    for path, why in bad:
        say(f"damaged and removed: {path}: {why}")
    say(f"{good} entries are whole, {len(bad)} were damaged, in {store.folder}")
    return DAMAGED if bad else 0


def _mebibytes(size: int) -> str:
    return f"{size / 2**20:.1f} MiB"
