"""Files of models, for other programs: surfaces (`surface`: OBJ, PLY, `gltf`), and named points (`points`: JSON).

All units are stated: in OBJ, PLY and JSON they are mm, in glTF the metre, as that format demands.
"""

__all__: list[str] = []
