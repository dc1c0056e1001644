//! The site file: TOML with units, unknown keys refused, all problems reported together.
