"""What was answered and judged before, by content: the same question to the same code has the same answer.

A question is everything that the answer depends on, as a `digests.Key` with a field for each: the scene, versions,
settings, packages, and the code by what the answering modules import (`closure`). Entries are signed with a secret of
the user; one that is not what was written is removed and its question asked anew. The renderer under test always
renders: a verdict is taken up again only for answers equal to the last byte.

To keep another kind of thing: a new file here that declares a `Key` of its own and asks `store` for it; the guard in
`reports/run/guards/keys.py` then wants a sample of the key, whose every field it changes.
"""
