"""Text and archives from strangers: one bounded reader for each format.

| module | reads |
|---|---|
| json_text | JSON: job files, bodies of requests, messages of the broker |
| toml_text | TOML: the `scene.toml` of a bundle |
| text_lines | text of lines: lens designs as CSV, .zmx and .seq, glass catalogues as .agf |
| gltf_file | glTF: the container and the JSON of .gltf and .glb, as models |
| zip_archive | zip files: scene bundles |
| file_names | the names of the files in an archive |
| shown | any value, for a message |

Every reader checks size, depth and counts in time linear in the size before a parser sees the text, because the parsers
of the standard library are recursive, and one is quadratic. A refusal names the field, what was expected and what came.
"""
