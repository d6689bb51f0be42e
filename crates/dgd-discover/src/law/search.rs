//! The data of a search for laws.

use dgd_compiler::model::Model;
use dgd_compiler::source::SourceMap;

use crate::fit::{FittedStructure, SearchData};
use crate::library::BaseModel;

/// The data for a search.
#[derive(Clone, Copy)]
pub(crate) struct LawSearch<'a> {
    pub(crate) base: &'a BaseModel,
    pub(crate) sources: &'a SourceMap,
    pub(crate) model: &'a Model,
    pub(crate) fitted: &'a FittedStructure,
    pub(crate) data: &'a SearchData<'a>,
    pub(crate) threads: usize,
}
