//! `dgd::model!` as rustc shows it, in tests; nothing is here.
