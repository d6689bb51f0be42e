//! The methods of `System` that compute Taylor series.
//!
//! ```text
//!   the initial values
//!   for each order: the coefficients of y and S from the previous slopes, then their own slopes
//! ```

use proc_macro2::{Ident, Span, TokenStream};
use quote::{format_ident, quote};

use super::fragment::CodeFragment;
use super::function::{StatementWriter, Statements, bind_arrays_of};
use super::literals::index;
use crate::program::{
    ConstantFactor, FunctionArgument, MatrixEntry, NoTaylor, Program, ProgramOperation, Recurrence,
    SharedSeries, ValueId,
};

/// `taylor_series`, `taylor` and `sensitivity_taylor`.
pub(super) fn methods(program: &Program) -> TokenStream {
    let path = quote!(::dgd::__runtime::taylor);
    let (series, functions) = match &program.taylor {
        Err(reason) => {
            let reason = match reason {
                NoTaylor::Algebraic => quote!(Algebraic),
                NoTaylor::Delays => quote!(Delays),
                NoTaylor::Arrays => quote!(Arrays),
                NoTaylor::Functions => quote!(Functions),
            };
            (
                quote!(::core::result::Result::Err(#path::NoTaylorSeries::#reason)),
                TokenStream::new(),
            )
        }
        Ok(taylor) => {
            // Without unknowns there is nothing to compute.
            let has_unknowns = program.n() > 0;
            let unknowns = index(taylor.unknowns.n_kept());
            let sensitivities = index(taylor.sensitivities.n_kept());
            let has_branches = taylor.sensitivities.has_branches;
            let kept = quote!(#path::KeptSeries {
                unknowns: #unknowns,
                sensitivities: #sensitivities,
                has_branches: #has_branches,
            });
            let mut functions = TokenStream::new();
            if has_unknowns {
                functions.extend(method(program, &taylor.unknowns, SeriesMethod::Taylor));
            }
            if has_unknowns && !program.signature.directions.is_empty() {
                functions.extend(method(
                    program,
                    &taylor.sensitivities,
                    SeriesMethod::SensitivityTaylor,
                ));
            }
            (quote!(::core::result::Result::Ok(#kept)), functions)
        }
    };
    quote! {
        #[inline]
        fn taylor_series(
            &self,
        ) -> ::core::result::Result<#path::KeptSeries, #path::NoTaylorSeries> {
            #series
        }
        #functions
    }
}

/// The method that a series is written as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SeriesMethod {
    Taylor,
    SensitivityTaylor,
}

fn method(program: &Program, series: &SharedSeries, name: SeriesMethod) -> TokenStream {
    let n = index(program.n());
    let n_s = index(program.signature.directions.len());
    let n_kept = index(series.n_kept());
    let with_sensitivities = name == SeriesMethod::SensitivityTaylor;
    let name = match name {
        SeriesMethod::Taylor => Ident::new("taylor", Span::call_site()),
        SeriesMethod::SensitivityTaylor => Ident::new("sensitivity_taylor", Span::call_site()),
    };
    let slopes_of_inputs = series
        .recurrences
        .iter()
        .flatten()
        .any(|recurrence| matches!(recurrence, Recurrence::Input(_)))
        .then_some(ProgramOperation::Load(FunctionArgument::Udot, 0));
    let arrays = bind_arrays_of(program, series.body.iter().chain(&slopes_of_inputs));
    let keeps = (0..series.n_kept()).map(|own| format_ident!("_c{}", own));
    let code = SeriesCode { program, series, with_sensitivities };
    let beginning = code.beginning();
    let continuation = code.continuation();
    let (s, s_rows, g, s_next) = if with_sensitivities {
        let next = (0..program.n()).map(|i| {
            let i = index(i);
            quote!(_s[_k * #n + #i] = ::dgd::__runtime::taylor::advance(&_g[#i], _per);)
        });
        (
            quote!(_s: &mut [f64],),
            quote!(let _s = ::dgd::__runtime::taylor::rows::<#n_s>(_s);),
            quote!(let mut _g = [[0.0; #n_s]; #n];),
            quote!(#(#next)*),
        )
    } else {
        (TokenStream::new(), TokenStream::new(), TokenStream::new(), TokenStream::new())
    };
    quote! {
        #[inline]
        fn #name(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _udot: &[f64],
            _h: f64,
            _order: usize,
            _kept: &mut [::dgd::__runtime::taylor::SeriesTerms],
            _series: &mut [f64],
            #s
        ) {
            #(#arrays)*
            let [#(#keeps),*] = ::dgd::__runtime::taylor::kept::<#n_kept>(_kept);
            let _series = ::dgd::__runtime::taylor::rows::<#n>(_series);
            #s_rows
            #g
            #beginning
            _series[0] = *::dgd::__runtime::codegen::fixed::<#n>(_at.y);
            for _k in 1..=_order {
                let _per = _h / _k as f64;
                _series[_k] = ::dgd::__runtime::taylor::advance(&_f, _per);
                #s_next
                if _k == _order {
                    break;
                }
                #continuation
            }
        }
    }
}

struct SeriesCode<'a> {
    program: &'a Program,
    series: &'a SharedSeries,
    with_sensitivities: bool,
}

impl SeriesCode<'_> {
    /// Initial values and slopes.
    fn beginning(&self) -> TokenStream {
        let series = self.series;
        let constants = series.constants();
        let kept =
            (0u32..).zip(&series.kept).filter_map(|(value, own)| own.map(|_| ValueId(value)));
        let entries = series.jacobian.iter().map(|entry| entry.value);
        let read = constants.iter().copied().chain(kept).chain(entries);
        let body = StatementWriter::of_series(self.program, series, read);
        let Statements { statements, pieces } = body.statements();
        let value = |value: ValueId| {
            let CodeFragment { tokens, .. } = &pieces[&value];
            tokens.clone()
        };
        let keeps = self.keeps(&value);
        let n = index(self.program.n());
        let f = series.f.iter().map(|f| value(*f));
        let g = self.slopes_of_sensitivities(
            &value,
            |entry| {
                let (value, column) = (value(entry.value), index(entry.column));
                quote!(::dgd::__runtime::taylor::add_scaled(_row, #value, &_s[#column]);)
            },
            |_| true,
        );
        // Recurrences read constants by the names that they have here.
        let fixed = constants.into_iter().map(|fixed| {
            let (name, value) = (fixed_name(fixed), value(fixed));
            quote!(let #name = #value;)
        });
        quote! {
            #(#statements)*
            #keeps
            #(#fixed)*
            let mut _f: [f64; #n] = [#(#f),*];
            #g
        }
    }

    /// Coefficients of order `_k`, and slopes of that order.
    fn continuation(&self) -> TokenStream {
        let series = self.series;
        let moving = (0u32..).zip(&series.recurrences).filter_map(|(value, recurrence)| {
            recurrence.map(|recurrence| (ValueId(value), recurrence))
        });
        let statements = moving.map(|(value, recurrence)| {
            let (name, coefficient) = (moving_name(value), self.coefficient(value, recurrence));
            let keep = series.kept[value.index()].map(|own| {
                let coefficient = format_ident!("_c{}", own);
                quote!(::dgd::__runtime::taylor::keep(#coefficient, _k, #name);)
            });
            quote!(let #name: f64 = #coefficient; #keep)
        });
        let value = |value: ValueId| {
            let name = moving_name(value);
            if series.moves(value) { quote!(#name) } else { quote!(0.0) }
        };
        let f = series.f.iter().map(|f| value(*f));
        let n = index(self.program.n());
        let g = self.slopes_of_sensitivities(
            &value,
            |entry| {
                let column = index(entry.column);
                let kept = series.kept[entry.value.index()].filter(|_| series.moves(entry.value));
                if let Some(kept) = kept {
                    let coefficient = format_ident!("_c{}", kept);
                    quote!(::dgd::__runtime::taylor::add_product(
                        _row, #coefficient, _s, #n, #column, _k,
                    );)
                } else {
                    let fixed = fixed_name(entry.value);
                    quote!(::dgd::__runtime::taylor::add_scaled(
                        _row, #fixed, &_s[_k * #n + #column],
                    );)
                }
            },
            |entry| series.moves(entry.value),
        );
        quote! {
            #(#statements)*
            _f = [#(#f),*];
            #g
        }
    }

    /// g of an order, row by row: `add` combines the entries of ∂f/∂y and the relevant entries of ∂f/∂θ.
    fn slopes_of_sensitivities(
        &self,
        value: &dyn Fn(ValueId) -> TokenStream,
        add: impl Fn(&MatrixEntry) -> TokenStream,
        counts: impl Fn(&MatrixEntry) -> bool,
    ) -> TokenStream {
        if !self.with_sensitivities {
            return TokenStream::new();
        }
        let n_s = index(self.program.signature.directions.len());
        let rows = (0..self.program.n()).map(|row| {
            let of_row = |entry: &&MatrixEntry| entry.row == row;
            let products = self.series.jacobian.iter().filter(of_row).map(&add);
            let directions = self.series.directions.iter().filter(of_row).filter(|e| counts(e));
            let directions = directions.map(|entry| {
                let (column, value) = (index(entry.column), value(entry.value));
                quote!(_row[#column] += #value;)
            });
            let row = index(row);
            quote! {
                let _row = &mut _g[#row];
                *_row = [0.0; #n_s];
                #(#products)*
                #(#directions)*
            }
        });
        quote!(#(#rows)*)
    }

    /// Stores the initial values.
    fn keeps(&self, value: &dyn Fn(ValueId) -> TokenStream) -> TokenStream {
        let kept = (0u32..)
            .zip(&self.series.kept)
            .filter_map(|(value, own)| own.map(|own| (ValueId(value), own)));
        let keeps = kept.map(|(kept, own)| {
            let (own, value) = (format_ident!("_c{}", own), value(kept));
            quote!(::dgd::__runtime::taylor::keep(#own, 0, #value);)
        });
        quote!(#(#keeps)*)
    }

    /// Σ c aₖ.
    fn sum(&self, first: usize, count: usize) -> TokenStream {
        let mut sum = TokenStream::new();
        for (position, (factor, value)) in
            self.series.terms[first..first + count].iter().enumerate()
        {
            let value = moving_name(*value);
            let is_first = position == 0;
            sum.extend(match factor {
                ConstantFactor::One if is_first => quote!(#value),
                ConstantFactor::One => quote!(+ #value),
                ConstantFactor::MinusOne => quote!(- #value),
                ConstantFactor::Of(factor) => {
                    let factor = fixed_name(*factor);
                    if is_first { quote!(#factor * #value) } else { quote!(+ #factor * #value) }
                }
            });
        }
        sum
    }

    /// The coefficient of order `_k` of a value.
    fn coefficient(&self, own: ValueId, recurrence: Recurrence) -> TokenStream {
        let kept = |value: ValueId| {
            let kept = self.series.kept[value.index()];
            format_ident!("_c{}", kept.unwrap_or_else(|| unreachable!("what is read is kept")))
        };
        let call = |name: &str, arguments: TokenStream| {
            let name = Ident::new(name, Span::call_site());
            quote!(::dgd::__runtime::taylor::#name(#arguments))
        };
        let (now, fixed) = (moving_name, fixed_name);
        match recurrence {
            Recurrence::Time => call("line", quote!(_h, _k)),
            Recurrence::Input(i) => {
                let i = index(i as usize);
                call("line", quote!(_h * _udot[#i], _k))
            }
            Recurrence::Unknown(i) => {
                let i = index(i as usize);
                quote!(_series[_k][#i])
            }
            Recurrence::Linear { first, count } => self.sum(first, count),
            Recurrence::Multiply(a, b) => {
                let (a, b) = (kept(a), kept(b));
                call("multiply", quote!(#a, #b, _k))
            }
            Recurrence::Square(a) => {
                let a = kept(a);
                call("square", quote!(#a, _k))
            }
            Recurrence::MultiplyLine(a, b) => {
                let (a, b) = (kept(a), kept(b));
                call("multiply_line", quote!(#a, #b, _k))
            }
            Recurrence::Divide(a, b, reciprocal) => {
                let a = a.map_or(quote!(0.0), |a| {
                    let a = now(a);
                    quote!(#a)
                });
                let (b, own, reciprocal) = (kept(b), kept(own), fixed(reciprocal));
                call("divide", quote!(#a, #b, #own, #reciprocal, _k))
            }
            Recurrence::Chain(x, d) => {
                let (x, d) = (kept(x), kept(d));
                call("chain", quote!(#x, #d, _k))
            }
            Recurrence::Root(a, half) => {
                let (a, own, half) = (now(a), kept(own), fixed(half));
                call("root", quote!(#a, #own, #half, _k))
            }
            Recurrence::Log(a, reciprocal) => {
                let (a, own, reciprocal) = (kept(a), kept(own), fixed(reciprocal));
                call("log", quote!(#a, #own, #reciprocal, _k))
            }
            Recurrence::Power(a, exponent, reciprocal) => {
                let (a, own) = (kept(a), kept(own));
                let (exponent, reciprocal) = (fixed(exponent), fixed(reciprocal));
                call("power", quote!(#a, #own, #exponent, #reciprocal, _k))
            }
            Recurrence::Magnitude(a) => {
                let a = kept(a);
                call("magnitude", quote!(#a, _k))
            }
            Recurrence::Select(c, a, b) => {
                let part = |part: Option<ValueId>| {
                    part.map_or(quote!(0.0), |value| {
                        let value = now(value);
                        quote!(#value)
                    })
                };
                let (c, a, b) = (fixed(c), part(a), part(b));
                quote!(if #c { #a } else { #b })
            }
        }
    }
}

/// Name of a constant value.
fn fixed_name(value: ValueId) -> Ident {
    format_ident!("_f{}", value.0)
}

/// Name of the coefficient of a varying value.
fn moving_name(value: ValueId) -> Ident {
    format_ident!("_d{}", value.0)
}
