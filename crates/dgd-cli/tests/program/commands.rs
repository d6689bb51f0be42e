//! The `dgd` command as a user sees it: exit codes, messages, files.

use std::fmt::Write as _;
use std::fs;

use serde_json::{Value, json};
use tempfile::TempDir;

use crate::golden::{Goldens, files};
use crate::support::{Run, column, command, dgd, dgd_in, folder_with, listing, path, root};

const TANK: &str = "tests/golden/data/model.dgd";
const DATA: &str = "tests/golden/data/good.csv";

/// Runs the tank with its data.
fn tank(command: &str, more: &[&str]) -> Run {
    dgd(&[&[command, TANK, "--data", DATA], more].concat())
}

/// The slope of x is its square, so x diverges at 1 s.
const EXPLOSION: &[u8] =
    b"model explosion\n\nstate x [1] = 1\n\nequation growth: der(x) = x^2 * 1 [1/s]\n";

#[test]
fn mistakes_in_data_are_shown_as_expected() {
    let folder = root().join("tests/golden/data");
    let mut goldens = Goldens::default();
    for path in files(&folder, "csv") {
        let name = path.file_name().and_then(|name| name.to_str()).expect("a plain name");
        if name == "good.csv" {
            continue;
        }
        let is_set = name.starts_with("E613");
        let data: &[&str] =
            if is_set { &["--data", "good.csv", "--ensemble", name] } else { &["--data", name] };
        let run = dgd_in(&folder, &[&["simulate", "model.dgd"], data].concat());
        // Unused columns cause only a note.
        let refused = !name.starts_with("E611");
        assert_eq!(run.code, i32::from(refused), "{name}: {}", run.err);
        assert_eq!(run.out.is_empty(), refused, "{name}: {}", run.out);
        goldens.compare(&path.with_extension("stderr"), &run.err);
    }
    goldens.finish();
}

#[test]
fn notes_on_sound_models_are_shown_as_expected() {
    let folder = root().join("tests/golden/notes");
    let mut goldens = Goldens::default();
    for path in files(&folder, "dgd") {
        let name = path.file_name().and_then(|name| name.to_str()).expect("a plain name");
        let run = dgd_in(&folder, &["check", name]);
        assert_eq!(run.code, 0, "{name}: {}", run.err);
        goldens.compare(&path.with_extension("stderr"), &run.err);
    }
    goldens.finish();
}

#[test]
fn exit_codes_are_as_promised() {
    let folder = folder_with(&[("explosion.dgd", EXPLOSION)]);
    let model = path(&folder, "explosion.dgd");
    assert_eq!(dgd(&["check", &model]).code, 0);
    assert_eq!(dgd(&["check", &model, "--set", "y=1"]).code, 1);
    assert_eq!(dgd(&["simulate", &model]).code, 2);
    assert_eq!(dgd(&["simulate", &model, "--until", "2"]).code, 3);
}

#[test]
fn results_do_not_depend_on_the_engine() {
    for command in ["simulate", "sensitivity"] {
        let run_by = |engine: &str| tank(command, &["--engine", engine]).done().out;
        let interpreted = run_by("interpreter");
        assert!(run_by("native") == interpreted, "{command}");
        assert!(run_by("auto") == interpreted, "{command}");
        assert!(tank(command, &[]).done().out == interpreted, "{command}");
    }
    tank("simulate", &["--engine", "steam"]).refused(2, &["steam", "native", "interpreter"]);
}

#[test]
fn results_tell_the_method() {
    let method = |more: &[&str]| {
        let run = tank("simulate", &[&["--format", "json"], more].concat()).done().json();
        run["method"].clone()
    };
    assert_eq!(method(&[]), "rodas5p");
    assert_eq!(method(&["--method", "auto"]), "rodas5p");
    assert_eq!(method(&["--method", "bdf"]), "bdf");
    let listed = dgd(&["methods"]).done().out;
    for name in ["rodas5p", "kencarp4", "bdf", "tsit5", "taylor", "auto"] {
        assert!(listed.contains(name), "{listed}");
    }
}

#[test]
fn a_failed_computation_names_equation_and_time() {
    let folder = folder_with(&[("explosion.dgd", EXPLOSION)]);
    let run = dgd(&["simulate", &path(&folder, "explosion.dgd"), "--until", "2"]);
    run.refused(3, &["equation `growth`", "t = 1.0000"]);
}

#[test]
fn missing_files_are_named() {
    dgd(&["check", "models/tnak.dgd"]).refused(1, &["cannot read `models/tnak.dgd`"]);
    dgd(&["fmt", "models/tnak.dgd"]).refused(1, &["cannot read `models/tnak.dgd`"]);
    dgd(&["simulate", TANK, "--data", "nowhere.csv"]).refused(1, &["cannot read `nowhere.csv`"]);
    dgd(&["check", "models"]).refused(1, &["cannot read `models`"]);
}

#[test]
fn wrong_usage_is_explained() {
    dgd(&["simulate", TANK, "--methd", "x"]).refused(2, &["--methd", "--method"]);
    dgd(&["simulat", TANK]).refused(2, &["simulat", "simulate"]);
    dgd(&["check"]).refused(2, &["<MODEL>"]);
    dgd(&["emit", TANK, "--stage", "rst"]).refused(2, &["rst", "rust"]);
    dgd(&["explain", "E999"]).refused(2, &["E999", "E101"]);
    tank("simulate", &["--method", "rodas"]).refused(2, &["rodas"]);
}

#[test]
fn inputs_need_data_and_a_run_needs_an_end() {
    dgd(&["simulate", TANK]).refused(2, &["`time [s]`, `q_in [lpm]`, `opening [%]`", "--data"]);
    dgd(&["simulate", "models/van_der_pol.dgd"]).refused(2, &["--until"]);
}

#[test]
fn wrong_settings_are_explained() {
    let set = |setting: &str| tank("simulate", &["--set", setting]);
    set("q_valv=3").refused(1, &["nothing is called `q_valv`", "did you mean `q_valve`?"]);
    set("p=3").refused(1, &["`p` is an output"]);
    set("q_in=3").refused(1, &["`q_in` is an input"]);
    set("k=-1").refused(1, &["`k` = -1", "bound of 0", "model.dgd:"]);
    set("A=3 [bar]").refused(1, &["m^2", "bar"]);
    set("A=3 [m^").refused(1, &["E104"]);
    set("A").refused(1, &["E105"]);
    set("").refused(1, &["E105"]);
}

#[test]
fn settings_change_parameters_constants_and_start_values() {
    let h = |more: &[&str]| column(&tank("simulate", more).done().out, "h [m]");
    let plain = h(&[]);
    assert_eq!(plain[0], 1.0);
    assert_eq!(h(&["--set", "h=150 [cm]"])[0], 1.5);
    assert_eq!(h(&["--set", "A=2"]), plain);
    assert_ne!(h(&["--set", "A=3"]), plain);
    assert_ne!(h(&["--set", "q_valve=500 [l/min]"]), plain);
}

#[test]
fn elements_of_arrays_are_columns_where_outputs_ask_for_them() {
    let model = b"model chain\nsize N = 3\ninput u\nstate x[1..N] = 1\nstate hidden[1..N] = 2\n\
        equation first: der(x[1]) = (u - x[1])/1 [s]\n\
        for i in 2..N { equation next[i]: der(x[i]) = (x[i-1] - x[i])/1 [s] }\n\
        for i in 1..N { equation decay[i]: der(hidden[i]) = -hidden[i]/1 [s] }\n\
        output x noise 0.1\noutput sum = x[1] + hidden[N]\n";
    let data = b"time [s],u,x[2]\n0,0,1\n1,0,0.7\n";
    let folder = folder_with(&[("chain.dgd", model), ("data.csv", data)]);
    let simulate = |more: &[&str]| {
        let all_args = [&["simulate", "chain.dgd", "--data", "data.csv"], more].concat();
        dgd_in(folder.path(), &all_args).done()
    };
    let run = simulate(&[]);
    let header = run.out.lines().next().expect("a header");
    assert_eq!(header, "time [s],u [1],sum [1],x[1] [1],x[2] [1],x[3] [1]");
    // The measured column belongs to an output of the model.
    assert!(!run.err.contains("does not know"), "{}", run.err);
    assert_eq!(column(&simulate(&["--set", "x=0.5"]).out, "x[3] [1]")[0], 0.5);
    let longer = simulate(&["--set", "N=5"]);
    assert_eq!(column(&longer.out, "x[5] [1]").len(), 2);
    let check = dgd_in(folder.path(), &["check", "chain.dgd", "--format", "json"]).done().json();
    assert_eq!(check["sizes"], json!([{ "name": "N", "value": 3 }]));
    assert_eq!(check["arrays"][0]["range"], json!([1, 3]));
    assert_eq!(check["outputs"][1]["range"], json!([1, 3]));
}

#[test]
fn wrong_variants_are_explained() {
    let check = |choice: &str| dgd(&["check", "models/mud_circulation.dgd", "--variant", choice]);
    check("flow=stattic").refused(1, &["no choice `stattic`", "did you mean `static`?"]);
    check("flwo=static").refused(1, &["no variant `flwo`", "did you mean `flow`?"]);
    check("static").refused(2, &["NAME=CHOICE"]);
    check("flow=static").done();
}

#[test]
fn unknown_names_of_sensitivities_are_explained() {
    tank("sensitivity", &["--to", "AA"])
        .refused(1, &["no parameter and no state `AA`", "did you mean `A`?"]);
    tank("sensitivity", &["--of", "q_ot"]).refused(1, &["`q_ot`", "did you mean `q_out`?"]);
}

#[test]
fn tolerances_must_be_positive_numbers() {
    for tolerance in ["0", "-1e-6", "NaN", "inf"] {
        tank("simulate", &[&format!("--rtol={tolerance}")]).refused(2, &["--rtol", "above 0"]);
        tank("simulate", &[&format!("--atol={tolerance}")]).refused(2, &["--atol", "above 0"]);
    }
    tank("simulate", &["--rtol", "small"]).refused(2, &["--rtol", "small"]);
}

#[test]
fn times_of_a_run_are_checked() {
    tank("simulate", &["--from", "30", "--until", "10"]).refused(2, &["30 s", "10 s"]);
    tank("simulate", &["--until", "NaN"]).refused(2, &["NaN"]);
    tank("simulate", &["--every", "0"]).refused(2, &["--every"]);
    tank("simulate", &["--every", "1e-300"]).refused(2, &["--every"]);
    tank("simulate", &["--until", "100"]).refused(3, &["60", "100"]);
}

#[test]
fn from_until_and_every_choose_the_rows() {
    let times = |more: &[&str]| column(&tank("simulate", more).done().out, "time [s]");
    assert_eq!(times(&[]), [0.0, 10.0, 20.0, 20.0, 40.0, 60.0]);
    assert_eq!(times(&["--every", "25"]), [0.0, 25.0, 50.0, 60.0]);
    assert_eq!(times(&["--from", "5", "--until", "15", "--every", "5"]), [5.0, 10.0, 15.0]);
    assert_eq!(times(&["--from", "40"]), [40.0, 60.0]);
}

#[test]
fn pictures_are_refused_with_nothing_written() {
    let folder = folder_with(&[]);
    let out = path(&folder, "out.csv");
    tank("simulate", &["--plot", "x.jpg", "-o", &out]).refused(2, &["x.jpg", ".svg, .pdf or .png"]);
    let lost = path(&folder, "nowhere/x.png");
    tank("simulate", &["--plot", &lost, "-o", &out]).refused(1, &["nowhere"]);
    assert_eq!(listing(&folder), Vec::<String>::new());
}

#[test]
fn pictures_are_drawn() {
    let folder = folder_with(&[]);
    let (svg, png) = (path(&folder, "a.svg"), path(&folder, "a.PNG"));
    let run = tank("simulate", &["--plot", &svg, "--plot", &png]).done();
    assert_eq!(run.out, "", "the picture stands for the table");
    assert!(fs::read_to_string(svg).expect("a picture").contains("</svg>"));
    assert!(fs::read(png).expect("a picture").starts_with(b"\x89PNG"));
}

#[test]
fn outputs_are_drawn_over_another_quantity() {
    let folder = folder_with(&[]);
    let svg = path(&folder, "curves.svg");
    let pump =
        ["models/subsea_pump.dgd", "--data", "examples/data/pump_curves.csv", "--every", "1"];
    let over =
        |name: &str| dgd(&[&["simulate"], &pump[..], &["--plot", &svg, "--over", name]].concat());
    over("q").done();
    let picture = fs::read_to_string(&svg).expect("a picture");
    // A panel of six heads, the system curve and the operating point, and one for its flow; no inputs, and no time.
    for text in ["[lpm]", "[m]", "head", "sys", "2000", "4000"] {
        assert!(picture.contains(text), "{text}");
    }
    assert!(!picture.contains("Time"));
    // If the abscissa is an output, the others are drawn over it.
    over("h_sys").done();
    assert!(fs::read_to_string(&svg).expect("a picture").contains("150"));

    // Curves of an array with their speeds as labels and the operating points; labels are not drawn as curves. Without
    // `--every` the curves are smooth, and the table is unchanged.
    let sweep =
        ["models/subsea_pump.dgd", "--data", "examples/data/pump_curves.csv", "--over", "q"];
    let table = path(&folder, "curves.csv");
    let marks = ["--label", "head=speed", "--mark", "q_at,h_at", "--mark", "q_op,h_op"];
    let both = ["--plot", &svg, "-o", &table];
    dgd(&[&["simulate"], &sweep[..], &marks, &both].concat()).done();
    let picture = fs::read_to_string(&svg).expect("a picture");
    for text in ["1000 rpm", "1200 rpm", "2000 rpm"] {
        assert_eq!(picture.matches(text).count(), 1, "{text}");
    }
    assert!(!picture.contains("[rpm]") && !picture.contains("speed"), "labels are not curves");
    let longest = picture.lines().filter(|line| line.contains("stroke-width=\"1.6\""));
    let points = longest.map(|line| line.matches(['l', ' ']).count()).max().unwrap_or_default();
    assert!(points > 300, "{points} points");
    assert_eq!(fs::read_to_string(&table).expect("a table").lines().count(), 3);
    for (option, said) in [
        (["--label", "head=sped"], "did you mean `speed`?"),
        (["--label", "head=h_sys"], "`head` has 6 elements and `h_sys` has 1"),
        (["--label", "head"], "two names, as in `head=speed`"),
        (["--mark", "q_at"], "two names, as in `q_op,h_op`"),
        (["--mark", "h_at,q_at"], "`h_at` is in m, and the axis of `q` in lpm"),
    ] {
        let wrong = [&["simulate"], &sweep[..], &["--plot", &svg], &option].concat();
        dgd(&wrong).refused(2, &[said]);
    }

    over("h_sis").refused(2, &["`--over h_sis`", "did you mean `h_sys`?"]);
    let no_picture = dgd(&[&["simulate"], &pump[..], &["--over", "q"]].concat());
    no_picture.refused(2, &["--plot"]);
}

#[test]
fn no_output_is_half_written() {
    let folder = folder_with(&[("explosion.dgd", EXPLOSION), ("old.csv", b"old\n")]);
    let model = path(&folder, "explosion.dgd");
    for name in ["old.csv", "new.csv"] {
        let out = path(&folder, name);
        let run = dgd(&["simulate", &model, "--until", "2", "--every", "0.25", "-o", &out]);
        run.refused(3, &["partial.csv (5 rows)"]);
    }
    let partial = ["new.partial.csv", "old.csv", "old.partial.csv"];
    assert_eq!(listing(&folder), [&["explosion.dgd"], &partial[..]].concat());
    assert_eq!(fs::read(folder.path().join("old.csv")).expect("it is there"), b"old\n");

    let lost = path(&folder, "nowhere/out.csv");
    dgd(&["simulate", &model, "--until", "0.5", "-o", &lost]).refused(1, &["nowhere"]);
}

#[test]
fn results_can_be_read_back_and_give_the_same() {
    let folder = folder_with(&[]);
    let printed = tank("simulate", &[]).done().out;
    for name in ["out.csv", "out.csv.gz"] {
        let out = path(&folder, name);
        tank("simulate", &["-o", &out]).done();
        assert_eq!(dgd(&["simulate", TANK, "--data", &out]).done().out, printed);
    }
    let packed = fs::read(folder.path().join("out.csv.gz")).expect("it was written");
    assert!(packed.starts_with(&[0x1f, 0x8b]), "a gzip stream");
}

#[test]
fn the_same_command_writes_the_same_bytes() {
    let folder = folder_with(&[]);
    for (flag, name) in
        [("-o", "out.csv"), ("-o", "out.csv.gz"), ("--plot", "out.svg"), ("--plot", "out.png")]
    {
        let out = path(&folder, name);
        let bytes = || {
            tank("sensitivity", &[flag, &out]).done();
            fs::read(&out).expect("it was written")
        };
        assert!(bytes() == bytes(), "{name}");
    }
}

#[test]
fn noise_comes_from_its_seed_only() {
    let with = |more: &[&str]| tank("simulate", more).done().out;
    let (plain, noisy) = (with(&[]), with(&["--noise-seed", "1"]));
    assert_eq!(noisy, with(&["--noise-seed", "1"]));
    assert_ne!(noisy, with(&["--noise-seed", "2"]));
    assert_ne!(column(&noisy, "p [bara]"), column(&plain, "p [bara]"));
    assert_eq!(column(&noisy, "q_out [lpm]"), column(&plain, "q_out [lpm]"), "without `noise`");
}

#[test]
fn start_values_come_from_measured_outputs() {
    let folder = folder_with(&[]);
    let recorded = path(&folder, "recorded.csv");
    let circulation = |data: &str, more: &[&str]| {
        let args = ["simulate", "models/mud_circulation.dgd", "--until", "2", "--data", data];
        dgd(&[&args, more].concat()).done().out
    };
    let elsewhere = ["--set", "h_r=60", "--set", "q_ssp=2000 [lpm]", "-o", &recorded];
    circulation("examples/data/circulation.csv", &elsewhere);

    let result = circulation(&recorded, &["--start", "measured"]);
    let recorded = fs::read_to_string(&recorded).expect("it was written");
    for (state, value) in [("h_r [m]", 60.0), ("q_ssp [lpm]", 2000.0)] {
        assert_eq!(column(&recorded, state)[0], value);
        // The search ends when a step is below the default tolerance, 1e-6.
        let gap = column(&result, state)[0] - value;
        assert!(gap.abs() < 1e-5 * value, "{state}: {gap}");
    }
}

#[test]
fn start_values_fit_noisy_measurements() {
    let data = "examples/data/circulation.csv";
    let model = "models/mud_circulation.dgd";
    let simulated =
        dgd(&["simulate", model, "--until", "2", "--data", data, "--start", "measured"]).done().out;
    let measured = fs::read_to_string(root().join(data)).expect("the example's data");
    // Two sensors with noise of 0.01 bar measure the level, so it is within three standard deviations of each.
    let gap = column(&simulated, "p_r [bara]")[0] - column(&measured, "p_r [bara]")[0];
    assert!(gap.abs() < 0.03, "{gap}");
}

#[test]
fn measured_starts_need_measurements() {
    let inputs = b"time [s],q_in [lpm],opening [%]\n0,300,50\n1,300,50\n";
    let folder = folder_with(&[("inputs.csv", inputs)]);
    let data = path(&folder, "inputs.csv");
    dgd(&["simulate", TANK, "--data", &data, "--start", "measured"])
        .refused(2, &["--start measured", "output"]);
}

#[test]
fn models_without_states_need_no_start_values() {
    let model = b"model line\ninput u\nparameter a = 1.5\noutput y = a*u  noise 0.1\n";
    let mut data = "time [s],u,y\n".to_owned();
    for k in 0..200 {
        let u = [1.0, 3.0, 2.0][k / 20 % 3];
        let y = 2.0 * u + 0.1 * [1.0, -1.0, 0.5, -0.5][k * k % 7 % 4];
        let _ = writeln!(data, "{k},{u},{y}");
    }
    let folder = folder_with(&[("line.dgd", model), ("a.csv", data.as_bytes())]);
    let run = |command: &str, more: &[&str]| {
        dgd_in(folder.path(), &[&[command, "line.dgd", "--data", "a.csv"], more].concat()).done()
    };
    let measured = run("simulate", &["--start", "measured"]).out;
    assert_eq!(measured, run("simulate", &[]).out);
    let fitted = run("fit", &["--start", "measured", "--format", "json"]).json();
    let a = fitted["parameters"]["a"]["value"].as_f64().expect("a number");
    assert!((a - 2.0).abs() < 0.02, "{a}");
    run("screen", &[]);
    run("discover", &[]);
}

#[test]
fn sensitivities_are_verified_on_demand() {
    let run = tank("sensitivity", &["--verify-sensitivities"]).done();
    assert!(run.err.contains("d(h)/d(A)") && run.err.contains("d(h)/d(k)"), "{}", run.err);
    assert!(!run.err.contains("WRONG"), "{}", run.err);
}

#[test]
fn sensitivities_have_the_columns_asked_for() {
    let header = |more: &[&str]| {
        let out = tank("sensitivity", more).done().out;
        out.lines().next().unwrap_or_default().to_owned()
    };
    assert_eq!(header(&["--of", "h", "--to", "A"]), "time [s],d(h)/d(A) [m/m^2]");
    let scaled = header(&["--of", "h", "--to", "A,k", "--scaled"]);
    assert_eq!(scaled, "time [s],A*d(h)/d(A) [m],k*d(h)/d(k) [m]");
    // h, p and q_out, each with respect to A and k.
    assert_eq!(header(&[]).matches(",d(").count(), 6);
}

#[test]
fn an_edit_of_the_model_changes_the_result() {
    let folder = folder_with(&[]);
    let model = path(&folder, "decay.dgd");
    let with = |rate: &str| {
        let equation = format!("equation loss: der(x) = -{rate} [1/s] * x");
        let text = format!("model decay\n\nstate x = 1\n\n{equation}\n");
        fs::write(&model, text).expect("the folder is writable");
        dgd(&["simulate", &model, "--until", "1"]).done().out
    };
    assert_ne!(with("1"), with("2"));
}

#[test]
fn parentheses_20_000_deep_are_refused() {
    let nested = format!("{}1{}", "(".repeat(20_000), ")".repeat(20_000));
    let model = format!("model deep\n\nlet a = {nested}\n");
    let folder = folder_with(&[("deep.dgd", model.as_bytes())]);
    dgd(&["check", &path(&folder, "deep.dgd")]).refused(1, &["E106", "deep.dgd:3"]);
    tank("simulate", &["--set", &format!("A={nested}")]).refused(1, &["E106"]);
}

/// Reproducible pseudorandom bytes: Knuth's 64-bit linear congruential generator.
fn random_bytes(seed: u64, n: usize) -> Vec<u8> {
    let mut state = seed;
    let mut next = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as u8
    };
    (0..n).map(|_| next()).collect()
}

#[test]
fn random_bytes_are_no_model_and_no_data() {
    let folder = folder_with(&[]);
    let file = path(&folder, "random");
    for seed in 0..20 {
        let mut bytes = random_bytes(seed, 2000);
        if seed % 2 == 1 {
            // Printable bytes pass the decoding of text.
            for byte in &mut bytes {
                *byte = b' ' + *byte % 95;
            }
        }
        fs::write(&file, &bytes).expect("the folder is writable");
        dgd(&["check", &file]).refused(1, &["random"]);
        dgd(&["fmt", &file]).refused(1, &["random"]);
        dgd(&["simulate", TANK, "--data", &file]).refused(1, &["random"]);
        assert!(fs::read(&file).expect("it is there") == bytes, "the file is left alone");
    }
}

#[test]
fn results_are_valid_json() {
    let check = dgd(&["check", TANK, "--format", "json"]).done().json();
    assert_eq!(check["diagnostics"], json!([]));

    let simulated = tank("simulate", &["--format", "json"]).done().json();
    assert_eq!(simulated["model"], "tank");
    assert_eq!(simulated["time"].as_array().map(Vec::len), Some(6));

    let more = ["--format", "json", "--verify-sensitivities"];
    let sensitivity = tank("sensitivity", &more).done().json();
    assert!(sensitivity["verification"]["sensitivities"].is_array());
    assert_eq!(sensitivity["columns"][0]["name"], "d(h)/d(A)");

    for args in [&["methods"][..], &["explain", "E301"]] {
        assert!(dgd(&[args, &["--format", "json"]].concat()).done().json().is_object());
    }
}

#[test]
fn mistakes_are_valid_json() {
    let wrong = "tests/golden/fail/E301_branches_of_an_if.dgd";
    let run = dgd(&["check", wrong, "--format", "json"]);
    assert_eq!(run.code, 1);
    let mistake = &run.json()["diagnostics"][0];
    assert_eq!(mistake["code"], "E301");
    assert_eq!(mistake["places"][0]["file"], wrong);
    assert_eq!(mistake["places"][0]["line"], 4);

    let run = dgd(&["check", "nowhere.dgd", "--format", "json"]);
    assert_eq!(run.code, 1);
    assert!(run.json()["error"].as_str().is_some_and(|error| error.contains("nowhere.dgd")));
}

#[test]
fn check_describes_the_model() {
    let description =
        dgd(&["check", "models/mud_circulation.dgd", "--format", "json"]).done().json();
    let names = |list: &str, key: &str| -> Vec<String> {
        let entries = description[list].as_array().expect("a list").iter();
        entries.map(|entry| entry[key].as_str().unwrap_or_default().to_owned()).collect()
    };
    assert_eq!(names("inputs", "name"), ["w_ssp", "q_boost", "q_tf"]);
    assert_eq!(names("states", "name"), ["h_r", "q_ssp"]);
    assert_eq!(names("parameters", "name"), ["M_ssp", "c0", "c1", "c2", "F1", "F2"]);
    assert_eq!(names("outputs", "name"), ["p_r", "p_in", "p_out", "q_ssp"]);
    assert_eq!(names("equations", "label"), ["riser", "return_line"]);
    assert_eq!(description["variants"][0]["choices"], json!(["dynamic", "static"]));
    assert_eq!(description["inputs"][1]["interpolation"], "linear");
    assert_eq!(description["outputs"][0]["noise"], 0.01);

    let (c0, c1) = (&description["parameters"][1], &description["parameters"][2]);
    assert_eq!(c0["value"], 275.0);
    assert_eq!(c0["unit"], "m");
    assert_eq!(c0["bounds"], json!([0.0, null]));
    assert_eq!((&c0["fixed"], &c1["fixed"]), (&json!(false), &json!(true)));
}

#[test]
fn check_looks_at_every_choice() {
    let text = "model tank\n\nstate h [m] = 1\n\nvariant flow {\n  \
                free { equation level: der(h) = 0 }\n  \
                closed { equation level: der(h) = 1 [bar] }\n}\n";
    let folder = folder_with(&[("tank.dgd", text.as_bytes())]);
    let model = path(&folder, "tank.dgd");
    dgd(&["check", &model]).refused(1, &["E302", "tank.dgd:7"]);
    dgd(&["check", &model, "--variant", "flow=free"]).done();
}

#[test]
fn colours_are_used_when_wanted() {
    let args = ["check", "tests/golden/fail/E112_only_remarks.dgd"];
    let coloured = |more: &[&str], no_color: &str| {
        let mut command = command(&root(), &[&args, more].concat());
        let output = command.env("NO_COLOR", no_color).output().expect("the command starts");
        Run::of(&output).err.contains('\u{1b}')
    };
    assert!(!coloured(&[], ""), "standard error is not a terminal");
    assert!(coloured(&["--color", "always"], ""));
    assert!(coloured(&["--color", "always"], "1"), "an option outweighs the environment");
    assert!(!coloured(&["--color", "never"], ""));
}

#[test]
fn quiet_leaves_errors_only() {
    assert_eq!(dgd(&["check", TANK, "--quiet"]).done().err, "");
    assert_ne!(dgd(&["check", TANK]).done().err, "");
    dgd(&["check", "nowhere.dgd", "--quiet"]).refused(1, &["nowhere.dgd"]);
}

#[test]
fn formatting_is_checked_then_done_then_idempotent() {
    let text = "model  tank\n\n\n\nstate h [m]=1  # level\nequation level:der( h )=0\n";
    let folder = folder_with(&[("tank.dgd", text.as_bytes())]);
    let file = path(&folder, "tank.dgd");
    let read = || fs::read_to_string(&file).expect("it is there");
    dgd(&["fmt", "--check", &file]).refused(1, &["tank.dgd"]);
    assert_eq!(read(), text);
    dgd(&["fmt", &file]).done();
    let formatted = read();
    assert!(formatted.contains("# level"), "{formatted}");
    dgd(&["fmt", "--check", &file]).done();
    dgd(&["fmt", &file]).done();
    assert_eq!(read(), formatted);
}

#[test]
fn nothing_is_formatted_where_one_file_is_wrong() {
    let text = b"model  tank\n";
    let folder = folder_with(&[("a.dgd", text), ("b.dgd", b"model tank\nlet a =\n")]);
    let (a, b) = (path(&folder, "a.dgd"), path(&folder, "b.dgd"));
    dgd(&["fmt", &a, &b]).refused(1, &["b.dgd:2"]);
    assert_eq!(fs::read(a).expect("it is there"), text);
}

#[test]
fn every_model_is_laid_out_canonically() {
    let mut args = vec!["fmt".to_owned(), "--check".to_owned()];
    for folder in ["models", "models/lib", "models/test_set", "tests/golden/data"] {
        let models = files(&root().join(folder), "dgd");
        args.extend(models.iter().map(|path| path.display().to_string()));
    }
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    dgd(&args).done();
}

#[test]
fn every_code_is_explained() {
    for info in dgd_compiler::diagnostics::codes::CODES {
        let code = info.code.to_string();
        let run = dgd(&["explain", &code.to_lowercase()]).done();
        assert!(run.out.starts_with(&format!("{code}: {}\n\n", info.title)), "{}", run.out);
        assert!(run.out.contains("Wrong:") && run.out.contains("Right:"), "{}", run.out);
    }
}

#[test]
fn every_stage_is_shown() {
    for stage in ["ast", "model", "dae", "program", "rust", "latex", "markdown"] {
        let run = dgd(&["emit", "models/pipe_flow.dgd", "--stage", stage]).done();
        assert!(run.out.contains("mu"), "{stage}: {}", run.out);
    }
}

const CIRCULATION: &str = "models/mud_circulation.dgd";

/// A recording made with parameters other than the model's, and with sensor noise.
fn recorded(folder: &TempDir, seed: &str) -> String {
    let data = path(folder, &format!("{seed}.csv"));
    let from = ["--data", "examples/data/circulation.csv", "--noise-seed", seed, "-o", &data];
    let set = ["--set", "c0=280", "--set", "F2=1.8e8", "--set", "h_r=52"];
    dgd(&[&["simulate", CIRCULATION][..], &from, &set].concat()).done();
    data
}

#[test]
fn a_fit_finds_what_a_recording_was_made_with() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let (train, valid) = (recorded(&folder, "1"), recorded(&folder, "2"));
    let goal = path(&folder, "fitted");
    let more = ["--noise", "declared", "--free", "c0,F2,M_ssp", "-o", &goal];
    let arguments = ["fit", CIRCULATION, "--data", &train, "--valid", &valid];
    let run = dgd(&[&arguments[..], &more].concat()).done();
    assert!(run.out.contains("rms train") && run.out.contains("F2"), "{}", run.out);
    assert_eq!(listing(&folder), ["1.csv", "2.csv", "fitted"]);

    let result = fs::read_to_string(format!("{goal}/result.json")).expect("a result");
    let result: Value = serde_json::from_str(&result).expect("JSON");
    let number = |value: &Value| value.as_f64().expect("a number");
    for (name, truth) in [("c0", 280.0), ("F2", 1.8e8), ("M_ssp", 1.1e8)] {
        let estimate = &result["parameters"][name];
        // Five standard deviations; the simulation and rounding errors of the data are far smaller.
        let (value, std) = (number(&estimate["value"]), number(&estimate["std"]));
        assert!((value - truth).abs() < 5.0 * std, "{name}: {estimate}");
    }
    assert_eq!(result["parameters"].as_object().expect("an object").len(), 3);
    assert_eq!(result["fixed"]["c2"], json!({ "value": 9000.0, "unit": "s^2/m^5" }));
    let h_r = &result["starts"][0]["values"]["h_r"];
    assert!((number(&h_r["value"]) - 52.0).abs() < 5.0 * number(&h_r["std"]), "{h_r}");

    // The fitted model is the given one with other values, and its simulation has the reported residuals.
    let fitted = format!("{goal}/mud_circulation.dgd");
    let text = fs::read_to_string(&fitted).expect("a model");
    let original = fs::read_to_string(root().join(CIRCULATION)).expect("a model");
    let changed: Vec<&str> = original
        .lines()
        .zip(text.lines())
        // Values of other lengths shift the text after them.
        .filter(|(original, text)| !original.split_whitespace().eq(text.split_whitespace()))
        .map(|(original, _)| original.split_whitespace().nth(1).expect("a name"))
        .collect();
    assert_eq!(changed, ["M_ssp", "c0", "F2", "h_r"]);
    let q_ssp = format!("q_ssp={}", number(&result["starts"][0]["values"]["q_ssp"]["value"]));
    let again = dgd(&["simulate", &fitted, "--data", &train, "--set", &q_ssp]).done();
    let measured = fs::read_to_string(&train).expect("the recording");
    for (name, header) in [("p_r", "p_r [bara]"), ("q_ssp", "q_ssp [lpm]")] {
        let pairs = column(&again.out, header).into_iter().zip(column(&measured, header));
        let squares: Vec<f64> = pairs.map(|(a, b)| (a - b).powi(2)).collect();
        let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        let document = number(&result["outputs"][name]["rms_train"]);
        // The fitted model keeps ten digits of the parameters, and the simulation is accurate to 1e-6 of 30 bar.
        assert!((rms / document - 1.0).abs() < 1e-3, "{name}: {rms} against {document}");
        let noise = number(&result["outputs"][name]["noise"]);
        let valid = number(&result["outputs"][name]["rms_valid"]);
        assert!((0.8..1.2).contains(&(valid / noise)), "{name}: {valid} against {noise}");
    }
}

#[test]
fn a_fit_that_cannot_be_says_why() {
    let model = "model explosion\nparameter k [1/s] = 2\nstate x [1] = 1  fixed\n\
                 equation e: der(x) = k*x*x\noutput y [1] = x\n";
    let folder = folder_with(&[
        ("model.dgd", model.as_bytes()),
        ("data.csv", b"time [s],y [1]\n0,1\n1,2\n"),
        ("other.csv", b"time [s],z [1]\n0,1\n1,2\n"),
    ]);
    let fit = |more: &[&str]| dgd_in(folder.path(), &[&["fit", "model.dgd"], more].concat());
    fit(&["--data", "data.csv"]).refused(3, &["data.csv", "cannot be simulated", "t = 0."]);
    fit(&["--data", "data.csv", "--fix", "k"]).refused(2, &["nothing is free"]);
    fit(&["--data", "other.csv"]).refused(1, &["nothing is measured", "`y [1]`"]);
    let settled = "start equation rest: der(x) = 2 [1/s]\n";
    let settled =
        model.replace("  fixed\n", "\n").replace("equation e:", &format!("{settled}equation e:"));
    std::fs::write(folder.path().join("settled.dgd"), settled).expect("writable");
    dgd_in(folder.path(), &["fit", "settled.dgd", "--data", "data.csv", "--free", "x"])
        .refused(1, &["E509", "`x` follows from start equation `rest`, so it is not free"]);
    std::fs::remove_file(folder.path().join("settled.dgd")).expect("it is there");
    fit(&["--data", "data.csv", "--fix", "q"]).refused(1, &["E201", "no parameter and no state"]);
    fit(&["--data", "data.csv", "--outputs", "q"]).refused(1, &["E201", "no output is called"]);
    fit(&["--data", "data.csv", "-o", "."])
        .refused(2, &["would replace", "which this command reads"]);
    fit(&[]).refused(2, &["--data"]);
    assert_eq!(listing(&folder), ["data.csv", "model.dgd", "other.csv"]);
}

#[test]
fn columns_can_be_in_units_that_a_model_declares() {
    let model = b"model pump\nunit stroke = 0.118 [l]\ninput rate [stroke/min]\nstate filled [stroke] = 2\n\
        equation level: der(filled) = rate\noutput filled\noutput volume [l] = filled\n";
    let data = b"time [min],rate [stroke/min],volume [stroke]\n0,40,2\n1,20,42\n2,20,62\n";
    let folder = folder_with(&[("pump.dgd", model), ("data.csv", data)]);
    let run = |arguments: &[&str]| dgd_in(folder.path(), arguments);
    let first = run(&["simulate", "pump.dgd", "--data", "data.csv", "-o", "out.csv"]).done();
    let out = fs::read_to_string(folder.path().join("out.csv")).expect("a result");
    let header = out.lines().next().expect("a header");
    assert_eq!(header, "time [s],rate [stroke/min],filled [stroke],volume [l]", "{}", first.err);
    let filled = column(&out, "filled [stroke]");
    for (found, expected) in filled.iter().zip([2.0, 42.0, 62.0]) {
        assert!((found - expected).abs() < 1e-9, "{filled:?}");
    }
    // A result is the data of another run; settings may have a unit as well.
    let set = ["--set", "filled=0.236 [l]"];
    let again = run(&[&["simulate", "pump.dgd", "--data", "out.csv"], &set[..]].concat()).done();
    assert_eq!(column(&again.out, "filled [stroke]"), filled);
    let misspelt = "time [min],rate [stroek/min]\n0,40\n1,20\n";
    fs::write(folder.path().join("wrong.csv"), misspelt).expect("a file");
    run(&["simulate", "pump.dgd", "--data", "wrong.csv"])
        .refused(1, &["E305", "no unit `stroek`", "did you mean `stroke`?"]);
}

#[test]
fn replicates_weigh_like_their_mean() {
    let model = |noise: &str| {
        format!(
            "model decay\ninput u\nparameter k [1/s] = 1  in 0 .. 10\nstate x = 2  fixed\n\
             equation x: der(x) = u*1 [1/s] - k*x\noutput x  noise {noise}\n"
        )
    };
    let (mut all, mut means) = (String::from("time [s],u,x\n"), String::from("time [s],u,x\n"));
    for k in 0..12 {
        let t = 0.25 * f64::from(k);
        let mean = 2.0 * (-0.7 * t).exp() + 0.02 * (3.0 * t).sin();
        let _ = writeln!(means, "{t},0,{mean}");
        for off in [-0.03, 0.01, 0.02] {
            let _ = writeln!(all, "{t},0,{}", mean + off);
        }
    }
    let (single, mean) = (model("0.03"), model(&format!("{}", 0.03 / 3.0_f64.sqrt())));
    let folder = folder_with(&[
        ("single.dgd", single.as_bytes()),
        ("mean.dgd", mean.as_bytes()),
        ("all.csv", all.as_bytes()),
        ("means.csv", means.as_bytes()),
    ]);
    let fit = |model: &str, data: &str| {
        let run = dgd_in(folder.path(), &["fit", model, "--data", data, "--format", "json"]).done();
        let k = run.json()["parameters"]["k"].clone();
        let number = |name: &str| k[name].as_f64().expect("a number");
        [number("value"), number("std")]
    };
    let ([all, _], [means, _]) = (fit("single.dgd", "all.csv"), fit("mean.dgd", "means.csv"));
    assert!((all - means).abs() < 1e-6, "{all} {means}");
    // Rows at the same time must agree in their inputs.
    let wrong = all_but(&folder);
    dgd_in(folder.path(), &["fit", "single.dgd", "--data", &wrong])
        .refused(1, &["E606", "differ in the input `u`"]);
}

/// The recording of replicates with a different input in one of its rows.
fn all_but(folder: &TempDir) -> String {
    let text = fs::read_to_string(folder.path().join("all.csv")).expect("the recording");
    let mut lines: Vec<&str> = text.lines().collect();
    let other = lines[5].replacen(",0,", ",1,", 1);
    lines[5] = &other;
    fs::write(folder.path().join("wrong.csv"), lines.join("\n")).expect("a file");
    "wrong.csv".to_owned()
}
