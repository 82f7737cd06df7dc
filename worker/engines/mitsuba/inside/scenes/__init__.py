"""Scene files of Mitsuba: from the bundle of a job at a frame to a scene that rays can be traced through.

| module | does |
|---|---|
| load | chooses the reader by the suffix of the scene file |
| loaded | the result, the limits, the notes, the names of files inside the bundle, the default light |
| xml | Mitsuba's own XML: an allow-list of elements and plugins, includes, defaults |
| gltf | .gltf and .glb: the whole file, its lights |
| gltf_accessors, gltf_nodes, gltf_materials, gltf_meshes | its arrays, tree and animation, materials, and meshes |
| mesh_checks, meshes | what a .obj or .ply announces, and its meshes |
| pictures, picture_sizes | textures, and the sizes in the headers of those that Mitsuba decodes |
| splat_file | Gaussian splats from a .ply, within limits |
| splats | Gaussian splats as a scene, and the light that rays receive from them |

All of it runs in the sandbox. What a file may hold is bounded before it is decoded all the same, so that a refusal
names the place in the file instead of a limit of the sandbox.
"""
