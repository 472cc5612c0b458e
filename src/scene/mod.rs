//! Scene files: TOML to plain data, plain data to a scene ready to trace.
