//! The dgd command.
