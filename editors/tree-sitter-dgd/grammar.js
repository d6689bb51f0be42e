// The equation language of dgd, for editors. Line ends mean nothing here: no expression goes on with a name, so that
// an item's end is seen from the next item's beginning. docs/language.md describes the language.

const comma = (rule) => seq(rule, repeat(seq(",", rule)), optional(","));

module.exports = grammar({
  name: "dgd",

  word: ($) => $.name,
  extras: ($) => [/\s/, $.doc_comment, $.comment],

  rules: {
    source_file: ($) => repeat($._item),

    doc_comment: () => token(prec(1, seq("///", /[^\n]*/))),
    comment: () => token(seq("#", /[^\n]*/)),

    _item: ($) =>
      choice(
        $.model,
        $.effect,
        $.import,
        $.declaration,
        $.unit_declaration,
        $.function,
        $.table,
        $.equation,
        $.variant,
        $.modes,
        $.loop,
        $.part,
        $.binding,
        $.when,
        $.every,
        $.saturate,
        $.start_steady,
        $.start_equation,
        $.clause,
      ),

    model: ($) => seq("model", field("name", $.name)),
    effect: ($) =>
      seq(
        "effect",
        field("name", $.name),
        choice(seq("on", $.name), seq("(", comma(seq($.name, ":", $.name, optional($.unit))), ")")),
      ),
    import: ($) => seq("import", $.string),

    declaration: ($) =>
      prec.right(
        seq(
          choice("constant", "parameter", "input", "state", "unknown", "held", "size", "let", "output"),
          field("name", $.dotted),
          repeat($.range_or_index),
          optional($.unit),
          optional(seq("=", $._value)),
          optional($._attributes),
        ),
      ),
    unit_declaration: ($) => seq("unit", field("name", $.name), "=", $.number),
    _value: ($) => choice($._expression, $.list),
    list: ($) => seq("(", $._value, repeat1(seq(",", $._value)), ")"),
    range_or_index: ($) =>
      seq(
        token.immediate(prec(1, "[")),
        optional(seq($.name, "in")),
        $._expression,
        optional(seq("..", $._expression)),
        "]",
      ),
    _attributes: ($) => prec.right(seq($.attribute, repeat(seq(",", $.attribute)))),
    attribute: ($) =>
      prec.right(
        choice(
          seq("in", optional($._expression), "..", optional($._expression)),
          "log",
          "fixed",
          "guess",
          "hold",
          "linear",
          "exact",
          "pchip",
          "natural",
          "cubic",
          seq("beyond", choice("refuse", "hold", "extend")),
          seq("nominal", $._expression),
          seq("noise", $._expression),
          seq("history", $._expression),
          seq("smooth", $._expression),
          seq(
            "prior",
            choice("normal", "lognormal", "uniform", "laplace", "gamma"),
            "(",
            $._expression,
            ",",
            $._expression,
            ")",
          ),
        ),
      ),

    function: ($) =>
      seq(
        "function",
        field("name", $.dotted),
        "(",
        comma($.argument),
        ")",
        "=",
        // A value that begins with a sign or a bracket is read as going on with the `let` above it.
        choice($._expression, seq("{", repeat1($.local), optional($._expression), "}")),
      ),
    table: ($) =>
      prec.right(
        seq(
          "table",
          field("name", $.dotted),
          "(",
          comma($.argument),
          ")",
          optional($.unit),
          choice(seq("=", comma($.point)), seq("at", $.point, "=", choice($.point, $.dotted)), seq("from", $.string)),
          optional($._attributes),
        ),
      ),
    point: ($) => seq("(", comma($._expression), ")"),
    local: ($) => seq("let", field("name", $.name), optional($.unit), "=", $._expression),
    argument: ($) => seq($.name, optional($.unit)),
    equation: ($) =>
      prec.right(
        seq(
          "equation",
          field("label", $.dotted),
          repeat($.range_or_index),
          ":",
          $._expression,
          "=",
          $._expression,
          optional($._attributes),
        ),
      ),
    start_equation: ($) =>
      prec.right(
        seq(
          "start",
          "equation",
          field("label", $.dotted),
          repeat($.range_or_index),
          ":",
          $._expression,
          "=",
          $._expression,
        ),
      ),

    variant: ($) => seq("variant", field("name", $.dotted), "{", repeat($.choice), "}"),
    choice: ($) => seq(field("name", $.name), "{", repeat($._item), "}"),
    modes: ($) =>
      seq(
        "modes",
        field("name", $.dotted),
        "{",
        repeat(choice($.choice, $.transition, $.start)),
        "}",
      ),
    transition: ($) =>
      prec.right(seq($.name, "->", $.name, "when", $._condition, optional($.resets))),
    start: ($) => prec.right(seq("start", $.name, optional(seq("if", $._expression)))),
    when: ($) => seq("when", $._condition, $.resets),
    every: ($) =>
      seq("every", $._expression, optional(seq("offset", $._expression)), $.resets),
    _condition: ($) => prec.left(seq($._crossing, repeat(seq("or", $._crossing)))),
    _crossing: ($) =>
      prec(
        2,
        seq($._expression, choice(seq("rises", "above"), seq("falls", "below")), $._expression),
      ),
    resets: ($) => seq("{", repeat1(seq("reset", $._target, "=", $._expression)), "}"),
    _target: ($) => choice($.dotted, $.element),
    loop: ($) => seq("for", $._counters, "{", repeat($._item), "}"),
    _counters: ($) => seq($.counter, repeat(seq(",", $.counter))),
    counter: ($) => seq($.name, "in", $._expression, "..", $._expression),

    part: ($) =>
      prec.right(
        seq(
          "part",
          field("name", $.name),
          repeat($.range_or_index),
          ":",
          field("model", $.name),
          optional(seq("(", comma($.setting), ")")),
        ),
      ),
    setting: ($) => seq($.dotted, "=", $._value),
    binding: ($) => seq($._target, "=", $._expression),
    start_steady: (_) => seq("start", "steady"),

    saturate: ($) => seq("saturate", $._target, choice(">=", "<="), $._expression),

    clause: ($) =>
      choice(
        seq(choice("kind", "form"), $.name),
        seq("null", $.name, "=", $._expression),
        seq(
          "replace",
          optional("output"),
          $.dotted,
          optional(seq("(", comma($.name), ")")),
          optional(seq("in", $.dotted)),
          "by",
          $._expression,
        ),
        seq("add", $._expression, "to", $.dotted),
      ),

    _expression: ($) =>
      choice(
        $.number,
        $.dotted,
        $.element,
        $.call,
        $.group,
        $.unary,
        $.binary,
        $.conditional,
      ),
    number: ($) => prec.right(seq($.literal, optional($.unit))),
    literal: () => /\d+(\.\d+)?([eE][+-]?\d+)?/,
    element: ($) => prec.right(10, seq($.dotted, repeat1($.range_or_index))),
    call: ($) =>
      prec(
        10,
        seq(
          field("function", $.dotted),
          "(",
          comma($._expression),
          optional(seq("for", $._counters)),
          ")",
        ),
      ),
    group: ($) => seq("(", $._expression, ")"),
    unary: ($) => choice(prec(6, seq("-", $._expression)), prec(3, seq("not", $._expression))),
    binary: ($) =>
      choice(
        prec.right(8, seq($._expression, "^", $._expression)),
        prec.left(7, seq($._expression, choice("*", "/"), $._expression)),
        prec.left(5, seq($._expression, choice("+", "-"), $._expression)),
        prec.left(4, seq($._expression, choice("<", "<=", ">", ">="), $._expression)),
        prec.left(2, seq($._expression, "and", $._expression)),
        prec.left(1, seq($._expression, "or", $._expression)),
      ),
    conditional: ($) =>
      prec.right(0, seq("if", $._expression, "then", $._expression, "else", $._expression)),

    dotted: ($) => prec.right(seq($.name, repeat(seq(".", $.name)))),
    name: () => /\p{L}[\p{L}\p{N}_]*/,
    unit: () => token(seq("[", /[^\[\]\n]*/, "]")),
    string: () => /"[^"\n]*"/,
  },
});
