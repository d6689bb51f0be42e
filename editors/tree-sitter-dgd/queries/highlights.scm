(comment) @comment
(doc_comment) @comment
(string) @string
(literal) @number
(unit) @type

["model" "effect" "import" "constant" "parameter" "input" "state" "unknown" "held" "unit" "size" "let" "output"
 "function" "table" "equation" "variant" "modes" "for" "part" "when" "every" "offset" "saturate" "start" "reset"
 "kind" "form" "null" "replace" "add" "on" "by" "to"] @keyword
["if" "then" "else"] @conditional
["and" "or" "not" "rises" "above" "falls" "below"] @keyword.operator
["log" "fixed" "guess" "hold" "linear" "exact" "nominal" "noise" "history" "prior" "normal" "lognormal" "uniform" "laplace" "gamma" "in" "at" "from"
 "pchip" "natural" "cubic" "beyond" "refuse" "extend" "smooth"] @attribute
["+" "-" "*" "/" "^" "=" "<" "<=" ">" ">=" "->" ".."] @operator

(call function: (dotted) @function)
(function name: (dotted) @function)
(table name: (dotted) @function)
(equation label: (dotted) @label)
(start_equation label: (dotted) @label)
(model name: (name) @namespace)
(part name: (name) @namespace)
(argument (name) @parameter)
(dotted) @variable
