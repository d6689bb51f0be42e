//! dgd
