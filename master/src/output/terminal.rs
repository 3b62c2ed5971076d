//! The result as a compact table on the terminal.
