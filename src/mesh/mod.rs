//! Input geometry: polygon meshes from OBJ files.
