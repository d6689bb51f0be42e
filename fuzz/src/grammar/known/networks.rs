//! Networks of resistors, sources, capacitors and piecewise linear diodes. Each node has a path to ground, so that
//! currents are strictly monotone in voltages and the solution is unique; it is found by a search through all states of
//! the diodes.

use std::cell::Cell;
use std::f64::consts::TAU;

use super::Draft;

/// A diode between two nodes, with a conductance for either direction.
struct Diode {
    from: usize,
    to: usize,
    on: f64,
    off: f64,
}

/// A network. Node 0 is ground.
struct Network {
    n: usize,
    /// Conductances between nodes.
    resistors: Vec<(usize, usize, f64)>,
    /// Sources behind a conductance at a node, with amplitude, frequency and phase.
    sources: Vec<(usize, f64, [f64; 3])>,
    diodes: Vec<Diode>,
    /// Capacity at each node, which may be zero.
    capacities: Vec<f64>,
    /// The last consistent states of the diodes, a bit for each.
    last: Cell<usize>,
}

pub(super) fn write(draft: &mut Draft) {
    let network = network(draft);
    let frequency = network.sources[0].2[1];
    let periods = draft.number(0.3, 3.0, 2);
    draft.until = periods / frequency;
    let until = draft.until;
    // The reference uses steps of equal length.
    if until * network.fastest() > 3000.0 {
        return write(draft);
    }
    text(draft, &network);
    let size = network.sources.iter().fold(1.0, |m: f64, source| m.max(source.2[0].abs()));
    let has_states = network.capacities.iter().any(|c| *c > 0.0);
    if !has_states {
        for share in [0.0, 0.37, 1.0] {
            let v = network.voltages(share * until, &vec![0.0; network.n + 1]);
            for (k, v) in v.iter().enumerate().skip(1) {
                draft.at(&format!("v{k}"), share * until, *v, size);
            }
        }
        return;
    }
    let v = network.after(until);
    for (k, v) in v.iter().enumerate().skip(1) {
        draft.at(&format!("v{k}"), until, *v, size);
    }
}

fn network(draft: &mut Draft) -> Network {
    let n = draft.whole(1, 4);
    let mut sources = Vec::new();
    for node in 1..=n {
        if node == 1 || draft.chance(0.4) {
            let frequency = if node == 1 || draft.chance(0.5) { 50.0 } else { 100.0 };
            let wave = [draft.number(5.0, 100.0, 0), frequency, draft.number(0.0, 1.0, 2)];
            sources.push((node, 1.0 / draft.number(0.5, 10.0, 1), wave));
        }
    }
    let other = |draft: &mut Draft, not: usize| loop {
        let node = draft.whole(0, n);
        if node != not {
            return node;
        }
    };
    let mut resistors: Vec<(usize, usize, f64)> = Vec::new();
    for node in 1..=n {
        resistors.push((node, 0, 1.0 / draft.number(20.0, 500.0, 0)));
        if draft.chance(0.3) {
            resistors.push((node, other(draft, node), 1.0 / draft.number(10.0, 200.0, 0)));
        }
    }
    let mut diodes = Vec::new();
    for _ in 0..draft.whole(1, 6) {
        let from = draft.whole(0, n);
        let target = other(draft, from);
        let on = *draft.random.pick(&[1.0, 10.0, 1000.0]);
        let off = *draft.random.pick(&[0.0, 1e-5, 1e-3]);
        diodes.push(Diode { from, to: target, on, off });
    }
    let mut capacities = vec![0.0; n + 1];
    if draft.chance(0.6) {
        capacities[draft.whole(1, n)] = draft.number(0.5, 5.0, 1) * 1e-3;
    }
    Network { n, resistors, sources, diodes, capacities, last: Cell::new(0) }
}

fn text(draft: &mut Draft, network: &Network) {
    let v = |node: usize| if node == 0 { "0 [V]".to_owned() } else { format!("v{node}") };
    let across = |from: usize, to: usize| match (from, to) {
        (0, to) => format!("-v{to}"),
        (from, 0) => format!("v{from}"),
        (from, to) => format!("v{from} - v{to}"),
    };
    let mut into: Vec<Vec<String>> = vec![Vec::new(); network.n + 1];
    for (k, (node, g, [amplitude, frequency, phase])) in network.sources.iter().enumerate() {
        draft.item(format!(
            "let e{k} = {amplitude} [V]*sin(2*pi*({frequency}*time/1 [s] + {phase}))"
        ));
        into[*node].push(format!("(e{k} - {})/{} [ohm]", v(*node), 1.0 / g));
    }
    for (from, to, g) in &network.resistors {
        let drop = across(*from, *to);
        for (node, sign) in [(*from, "-"), (*to, "")] {
            into[node].push(format!("{sign}({drop})/{} [ohm]", 1.0 / g));
        }
    }
    for (k, diode) in network.diodes.iter().enumerate() {
        let drop = across(diode.from, diode.to);
        let Diode { on, off, .. } = diode;
        let current = match draft.random.below(3) {
            0 => format!("max({on} [S]*({drop}), {off} [S]*({drop}))"),
            1 => format!("(if {drop} > 0 [V] then {on} [S] else {off} [S])*({drop})"),
            _ => format!("{} [S]*max({drop}, 0 [V]) + {off} [S]*({drop})", on - off),
        };
        if draft.chance(0.5) {
            draft.item(format!("unknown d{k} [A] = 0"));
            draft.item(format!("equation d{k}: d{k} = {current}"));
        } else {
            draft.item(format!("let d{k} = {current}"));
        }
        into[diode.from].push(format!("-d{k}"));
        into[diode.to].push(format!("d{k}"));
    }
    for node in 1..=network.n {
        let sum = into[node].join(" + ").replace("+ -", "- ");
        let capacity = network.capacities[node];
        if capacity > 0.0 {
            draft.item(format!("state v{node} [V] = 0  nominal 10"));
            draft
                .item(format!("equation node{node}: {} [mF]*der(v{node}) = {sum}", capacity * 1e3));
        } else {
            draft.item(format!("unknown v{node} [V] = 0"));
            draft.item(format!("equation node{node}: 0 = {sum}"));
        }
        draft.item(format!("output v{node}"));
    }
}

impl Network {
    /// Currents out of the nodes are G v − s, with these diodes conducting and without those of capacitors.
    fn system(&self, t: f64, on: usize) -> (Vec<Vec<f64>>, Vec<f64>) {
        let mut g = vec![vec![0.0; self.n + 1]; self.n + 1];
        let mut s = vec![0.0; self.n + 1];
        let mut between = |a: usize, b: usize, by: f64| {
            g[a][a] += by;
            g[b][b] += by;
            g[a][b] -= by;
            g[b][a] -= by;
        };
        for (from, to, by) in &self.resistors {
            between(*from, *to, *by);
        }
        for (k, diode) in self.diodes.iter().enumerate() {
            between(diode.from, diode.to, if on >> k & 1 == 1 { diode.on } else { diode.off });
        }
        for (node, by, [amplitude, frequency, phase]) in &self.sources {
            g[*node][*node] += by;
            s[*node] += by * amplitude * (TAU * (frequency * t + phase)).sin();
        }
        (g, s)
    }

    /// Voltages of all nodes with these diodes conducting and given voltages at capacities, and the largest violation
    /// of a diode's state.
    fn with(&self, on: usize, t: f64, given: &[f64]) -> (Vec<f64>, f64) {
        let (mut g, mut s) = self.system(t, on);
        for node in 0..=self.n {
            if node == 0 || self.capacities[node] > 0.0 {
                g[node] = vec![0.0; self.n + 1];
                g[node][node] = 1.0;
                s[node] = if node == 0 { 0.0 } else { given[node] };
            }
        }
        let v = solved(g, s);
        let wrong = self.diodes.iter().enumerate().map(|(k, diode)| {
            let drop = v[diode.from] - v[diode.to];
            if on >> k & 1 == 1 { -drop } else { drop }
        });
        let wrong = wrong.fold(0.0, f64::max);
        (v, wrong)
    }

    /// Voltages of all nodes for the most consistent states of the diodes. The last ones are tried first.
    fn voltages(&self, t: f64, given: &[f64]) -> Vec<f64> {
        let states = std::iter::once(self.last.get()).chain(0..1 << self.diodes.len());
        let mut best: Option<(f64, Vec<f64>)> = None;
        for on in states {
            let (v, wrong) = self.with(on, t, given);
            if best.as_ref().is_none_or(|(least, _)| wrong < *least) {
                best = Some((wrong, v));
                self.last.set(on);
            }
            if wrong == 0.0 {
                break;
            }
        }
        best.map(|(_, v)| v).unwrap_or_default()
    }

    /// The fastest rate at which the voltage at the capacity settles, 1/s.
    fn fastest(&self) -> f64 {
        let Some(node) = (1..=self.n).find(|node| self.capacities[*node] > 0.0) else { return 0.0 };
        let mut unit = vec![0.0; self.n + 1];
        unit[node] = 1.0;
        let current = |on: usize, given: &[f64]| -> f64 {
            let (v, _) = self.with(on, 0.0, given);
            self.system(0.0, on).0[node].iter().zip(&v).map(|(g, v)| g * v).sum()
        };
        let zero = vec![0.0; self.n + 1];
        let rate = |on| (current(on, &unit) - current(on, &zero)).abs() / self.capacities[node];
        (0..1 << self.diodes.len()).map(rate).fold(0.0, f64::max)
    }

    /// Time derivatives of the voltages at capacities.
    fn slopes(&self, t: f64, given: &[f64]) -> Vec<f64> {
        let v = self.voltages(t, given);
        let conducts = |k: &usize| v[self.diodes[*k].from] > v[self.diodes[*k].to];
        let on = (0..self.diodes.len()).filter(conducts).fold(0, |on, k| on | 1 << k);
        let (g, s) = self.system(t, on);
        let out = |node: usize| -> f64 {
            g[node].iter().zip(&v).map(|(g, v)| g * v).sum::<f64>() - s[node]
        };
        (0..=self.n)
            .map(|node| match self.capacities[node] {
                0.0 => 0.0,
                capacity => -out(node) / capacity,
            })
            .collect()
    }

    /// Voltages after a time, from 0 at capacities, by the classical Runge–Kutta method of order 4, with steps so short
    /// that corners cause little error.
    fn after(&self, until: f64) -> Vec<f64> {
        let steps = (until * self.fastest() / 0.1).max(10_000.0) as usize;
        let h = until / steps as f64;
        let mut v = vec![0.0; self.n + 1];
        let moved = |v: &[f64], k: &[f64], by: f64| -> Vec<f64> {
            v.iter().zip(k).map(|(v, k)| v + by * k).collect()
        };
        for step in 0..steps {
            let t = step as f64 * h;
            let k1 = self.slopes(t, &v);
            let k2 = self.slopes(t + 0.5 * h, &moved(&v, &k1, 0.5 * h));
            let k3 = self.slopes(t + 0.5 * h, &moved(&v, &k2, 0.5 * h));
            let k4 = self.slopes(t + h, &moved(&v, &k3, h));
            for node in 0..=self.n {
                v[node] += h / 6.0 * (k1[node] + 2.0 * k2[node] + 2.0 * k3[node] + k4[node]);
            }
        }
        self.voltages(until, &v)
    }
}

/// Solves a small system by elimination with pivoting.
fn solved(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|i, j| a[*i][k].abs().total_cmp(&a[*j][k].abs())).unwrap_or(k);
        a.swap(k, pivot);
        b.swap(k, pivot);
        for i in k + 1..n {
            let factor = a[i][k] / a[k][k];
            for j in k..n {
                a[i][j] -= factor * a[k][j];
            }
            b[i] -= factor * b[k];
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| a[k][j] * b[j]).sum();
        b[k] = (b[k] - known) / a[k][k];
    }
    b
}
