//! Options with a name each: an enum, its names and its descriptions, written once.

/// An enum whose variants are the values of an option. [`choices!`](crate::choices) declares one.
pub trait NamedChoice: Copy + Default + 'static {
    /// All values, in the order in which they are listed; the first is the default.
    const ALL: &'static [Self];

    /// Its name: the word for it on the command line, in Python and in results.
    fn name(self) -> &'static str;

    /// Other spellings of its name.
    fn aliases(self) -> &'static [&'static str];

    /// A sentence about it, as in the help of the command, without a full stop.
    fn summary(self) -> &'static str;

    /// The value of this name.
    fn from_name(name: &str) -> Option<Self> {
        let is_called = |one: &Self| one.name() == name || one.aliases().contains(&name);
        Self::ALL.iter().copied().find(is_called)
    }
}

/// Declares an enum of options: each variant with its description and name, and perhaps with other spellings.
///
/// The first variant is the default. Command line, Python and the tests of the manual use the list `ALL`, so a variant
/// is written nowhere else.
///
/// ```
/// dgd_signature::choices! {
///     /// Colour of a wine.
///     pub enum Wine {
///         /// From dark grapes.
///         Red = "red",
///         /// From any grapes, without their skins.
///         White = "white" | "blanc",
///     }
/// }
/// use dgd_signature::NamedChoice;
///
/// assert_eq!(Wine::from_name("blanc"), Some(Wine::White));
/// assert_eq!(Wine::Red.summary(), "From dark grapes");
/// assert_eq!(Wine::ALL.len(), 2);
/// ```
#[macro_export]
macro_rules! choices {
    (
        $(#[$attribute:meta])*
        $visibility:vis enum $Choice:ident {
            $($(#[doc = $line:literal])+ $Variant:ident = $name:literal $(| $alias:literal)*,)+
        }
    ) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        $visibility enum $Choice {
            $($(#[doc = $line])+ $Variant,)+
        }

        impl $Choice {
            /// All, in the order in which they are listed; the first is the default.
            pub const ALL: &'static [Self] = &[$(Self::$Variant),+];

            /// Its name on the command line, in Python and in results.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$Variant => $name,)+
                }
            }
        }

        impl $crate::NamedChoice for $Choice {
            const ALL: &'static [Self] = Self::ALL;

            fn name(self) -> &'static str {
                self.name()
            }

            fn aliases(self) -> &'static [&'static str] {
                match self {
                    $(Self::$Variant => &[$($alias),*],)+
                }
            }

            fn summary(self) -> &'static str {
                let lines = match self {
                    $(Self::$Variant => concat!($($line),+),)+
                };
                lines.trim().trim_end_matches('.')
            }
        }

        impl ::core::default::Default for $Choice {
            fn default() -> Self {
                Self::ALL[0]
            }
        }

        impl ::core::fmt::Display for $Choice {
            fn fmt(&self, f: &mut ::core::fmt::Formatter<'_>) -> ::core::fmt::Result {
                f.pad(self.name())
            }
        }
    };
}
