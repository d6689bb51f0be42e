//! Parts and bindings as a file has them.

use crate::syntax::ast::{ArrayAxis, Item, ItemKind, Name, PartArgument};

/// The choices of variants that contain an item.
pub(super) type ChoicePath = Vec<(String, usize)>;

/// A part as written.
pub(super) struct WrittenPart<'a> {
    pub(super) path: ChoicePath,
    pub(super) item: &'a Item,
    pub(super) name: &'a Name,
    pub(super) axes: &'a [ArrayAxis],
    pub(super) model: &'a Name,
    pub(super) arguments: &'a [PartArgument],
}

/// A binding of a part's input.
pub(super) struct InputBinding<'a> {
    pub(super) path: ChoicePath,
    pub(super) input: &'a Name,
    pub(super) extent: BindingExtent,
}

/// Extent of the input that a binding covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BindingExtent {
    /// All of it.
    Whole,
    /// The elements of a loop.
    Loop,
    /// One element.
    Element,
}

impl InputBinding<'_> {
    /// Whether another binding of the same input can be active together with it.
    pub(super) fn meets(&self, other: &InputBinding<'_>) -> bool {
        other.input.text == self.input.text && agree(&other.path, &self.path)
    }

    /// Whether it is active whenever the part is.
    pub(super) fn is_there_with(&self, part: &WrittenPart<'_>) -> bool {
        self.path.iter().all(|choice| part.path.contains(choice))
    }
}

/// The parts and the bindings among items, in the order written.
pub(super) fn collect<'i>(
    items: &'i [Item],
    path: &mut ChoicePath,
    parts: &mut Vec<WrittenPart<'i>>,
    bindings: &mut Vec<InputBinding<'i>>,
) {
    for item in items {
        match &item.kind {
            ItemKind::Part { name, axes, model, arguments } => {
                let path = path.clone();
                parts.push(WrittenPart { path, item, name, axes, model, arguments });
            }
            ItemKind::Binding { input, indices, .. } => {
                let extent =
                    if indices.is_empty() { BindingExtent::Whole } else { BindingExtent::Element };
                bindings.push(InputBinding { path: path.clone(), input, extent });
            }
            ItemKind::For { items, .. } => {
                for item in items {
                    if let ItemKind::Binding { input, .. } = &item.kind {
                        bindings.push(InputBinding {
                            path: path.clone(),
                            input,
                            extent: BindingExtent::Loop,
                        });
                    }
                }
            }
            ItemKind::Variant { name, choices } => {
                for (i, choice) in choices.iter().enumerate() {
                    path.push((name.text.clone(), i));
                    collect(&choice.items, path, parts, bindings);
                    path.pop();
                }
            }
            _ => {}
        }
    }
}

/// Whether two items can be active together.
pub(super) fn agree(a: &ChoicePath, b: &ChoicePath) -> bool {
    let apart = |(variant, choice): &(String, usize)| {
        b.iter().any(|(other, chosen)| other == variant && chosen != choice)
    };
    !a.iter().any(apart)
}
