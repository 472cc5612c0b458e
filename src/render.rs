//! The renderer: a scene to a picture, tile by tile.
