//! Expanded items of parts.

use super::*;
use crate::syntax::print::print;
use crate::tank::{TANK, TankCompilation};

/// Loads files; the first can import the others.
fn loaded(files: &[(&str, &str)]) -> Vec<Ast> {
    TankCompilation::new(files).asts
}

/// The model with the items of its parts in place.
fn expanded(asts: &[Ast]) -> FlatModel<'_> {
    expand(asts, &mut Diagnostics::default()).expect("parts that fit")
}

#[test]
fn items_of_a_part_have_its_name_before_theirs() {
    let main = "model pond\nimport \"tank.dgd\"\npart one: tank\none.q_in = 2\nlet x = one.p\n";
    let asts = loaded(&[("pond.dgd", main), ("tank.dgd", TANK)]);
    let expanded = expanded(&asts);
    let text = print(&expanded.asts[0]);
    assert_eq!(
        text,
        "\
model pond
import \"tank.dgd\"
constant one.g [m/s^2] = 9.81
constant one.A [m^2] = 2
constant one.V [m^3] = 3 [m]*one.A
parameter one.a [m^2] = 0.01 in 0 ..
state one.h [m] = 1
function one.speed(depth [m]) = sqrt(2*one.g*depth)
let one.q_out = one.a*one.speed(one.h)
equation one.level: one.A*der(one.h) = one.q_in - one.q_out
let one.p [bar] = 1000 [kg/m^3]*one.g*one.h
let one.q_in [m^3/s] = 2
let x = one.p
"
    );
    assert_eq!(expanded.asts.len(), 1);
    let [part] = &expanded.parts[..] else { panic!("{:?}", expanded.parts) };
    assert_eq!((part.name.as_str(), part.model.as_str()), ("one", "tank"));
}

#[test]
fn what_differs_between_several_parts_gets_an_index() {
    let cell = "model cell\ninput i\ninput beside\nconstant c = 2\nparameter k = 1 in 0 ..\n\
                parameter b = 3\nconstant half = k/2\nstate x = b\nfunction f(y) = c*y\n\
                let loss = k*x + half\nequation e: 1 [s]*der(x) = i - f(loss) + beside\n\
                output y = sum(x*j for j in 1..2)\n";
    let main = "model pack\nimport \"cell.dgd\"\nsize N = 3\ninput i\nparameter k[1..N] = 1\n\
                part cell[j in 1..N]: cell(k = k[j], b = (1, 2, 4))\ncell.i = i\n\
                cell.beside[1] = 0\nfor j in 2..N { cell.beside[j] = cell.y[j-1] }\n";
    let asts = loaded(&[("pack.dgd", main), ("cell.dgd", cell)]);
    let expanded = expanded(&asts);
    assert_eq!(
        print(&expanded.asts[0]),
        "\
model pack
import \"cell.dgd\"
size N = 3
input i
parameter k[1..N] = 1
unknown cell.beside[1..N]
constant cell.c = 2
for i_1 in 1..N {
  let cell.k[i_1] [1] = k[i_1]
}
parameter cell.b[1..N] = (1, 2, 4)
for i_1 in 1..N {
  let cell.half[i_1] [1] = cell.k[i_1]/2
}
state cell.x[i_1 in 1..N] = cell.b[i_1]
function cell.f(y) = cell.c*y
for i_1 in 1..N {
  let cell.loss[i_1] = cell.k[i_1]*cell.x[i_1] + cell.half[i_1]
}
for i_1 in 1..N {
  equation cell.e[i_1]: 1 [s]*der(cell.x[i_1]) = cell.i[i_1] - cell.f(cell.loss[i_1]) + cell.beside[i_1]
}
for i_1 in 1..N {
  let cell.y[i_1] [1] = sum(cell.x[i_1]*j for j in 1..2)
}
for j in 1..N {
  let cell.i[j] [1] = i
}
equation cell.beside_1: cell.beside[1] = 0 [1]
for j in 2..N {
  equation cell.beside_2_to_N[j]: cell.beside[j] = cell.y[j-1]
}
"
    );
}

#[test]
fn what_has_no_parts_is_not_copied() {
    let asts = loaded(&[("tank.dgd", TANK)]);
    assert!(matches!(expanded(&asts).asts, Cow::Borrowed(_)));
}

#[test]
fn modes_functions_and_delays_of_a_part_are_its_own() {
    let valve = "model valve\ninput u\nparameter tau [s] = 2\nparameter k = 1\nstate x = 1\n\
                 function gain(k) = 2*k\n\
                 modes side {\nopen { equation e: der(x) = -gain(k)*x/1 [s] }\n\
                 shut { equation e: der(x) = 0 }\n\
                 open -> shut when x falls below delay(u, tau) { reset x = k }\n\
                 start shut\nstart open if x > k and not u > tau/1 [s]\n}\n";
    let main = "model whole\nimport \"valve.dgd\"\ninput w\npart one: valve\none.u = w\n\
                modes side {\na { equation f: y = one.x }\nb { equation f: y = 0 }\n\
                a -> b when y rises above 2 { reset one.x = 3 }\n}\nunknown y\n";
    let asts = loaded(&[("w.dgd", main), ("valve.dgd", valve)]);
    let text = print(&expanded(&asts).asts[0]);
    let expected = "\
parameter one.tau [s] = 2
parameter one.k = 1
state one.x = 1
function one.gain(k) = 2*k
modes one.side {
  open {
    equation one.e: der(one.x) = -one.gain(one.k)*one.x/1 [s]
  }
  shut {
    equation one.e: der(one.x) = 0
  }
  open -> shut when one.x falls below delay(one.u, one.tau) {
    reset one.x = one.k
  }
  start shut
  start open if one.x > one.k and not one.u > one.tau/1 [s]
}
let one.u [1] = w
";
    assert!(text.contains(expected), "{text}");
}
