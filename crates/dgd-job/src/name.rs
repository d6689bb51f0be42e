//! Names of pieces: digests of everything that determines their results.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use dgd_data::{DiskFiles, Sha256Digest};
use dgd_identify::journal::Digest;
use dgd_work::{Argument, FOLDER, digest_of_texts};

use crate::identity::BuildIdentity;
use crate::piece::{Piece, PieceKind};
use crate::syntax::OptionSyntax;

/// Names the pieces of a job. Each file is read once.
#[derive(Debug)]
pub struct PieceKeys {
    folder: PathBuf,
    syntax: OptionSyntax,
    of: Digest,
    models: Mutex<BTreeMap<(String, Vec<String>), String>>,
    /// The digest of a data file, or the error of reading it.
    data: Mutex<BTreeMap<String, Result<Sha256Digest, String>>>,
}

impl PieceKeys {
    /// For pieces whose paths are relative to this folder, computed by this build.
    pub fn new(folder: &Path, identity: &BuildIdentity, syntax: OptionSyntax) -> PieceKeys {
        let BuildIdentity { version, build, platform, arithmetic } = identity;
        PieceKeys {
            folder: folder.to_owned(),
            syntax,
            of: Digest::EMPTY.debug(&"dgd piece 1").debug(&(version, build, platform, arithmetic)),
            models: Mutex::default(),
            data: Mutex::default(),
        }
    }

    /// The name of a piece, 32 hexadecimal digits.
    pub fn key(&self, piece: &Piece) -> String {
        let model = self.model(piece);
        let files = || piece.data.iter().chain(&piece.valid);
        let data: Vec<Result<Sha256Digest, String>> = files().map(|file| self.data(file)).collect();
        let digest =
            self.of.debug(&(&piece.well, &piece.when, &piece.kind, piece.words(self.syntax)));
        format!("{:032x}", digest.debug(&(model, data)).value())
    }

    /// The digest of the texts of its model and of its effects.
    fn model(&self, piece: &Piece) -> String {
        let mut apply = self.syntax.values(&piece.options, Argument::Apply);
        let mut folders = Vec::new();
        if piece.kind == PieceKind::Discover {
            folders = self.syntax.values(&piece.options, Argument::Effects);
        }
        let key = (piece.model.clone(), [apply.as_slice(), &folders].concat());
        let mut key_of_kind = key.clone();
        key_of_kind.1.push(piece.kind.command().to_owned());
        if let Some(known) = lock(&self.models).get(&key_of_kind) {
            return known.clone();
        }
        // The path of an effect file is relative to the folder of the job, like that of the model.
        for effect in &mut apply {
            if effect.split('(').next().is_some_and(is_file) {
                *effect = self.folder.join(&*effect).display().to_string();
            }
        }
        let model = self.folder.join(&piece.model);
        let mut folders: Vec<PathBuf> = folders.iter().map(|one| self.folder.join(one)).collect();
        if piece.kind == PieceKind::Discover {
            folders.push(model.parent().unwrap_or(Path::new("")).join(FOLDER));
        }
        let digest = digest_of_texts(&model, &apply, &folders, &DiskFiles);
        lock(&self.models).insert(key_of_kind, digest.clone());
        digest
    }

    fn data(&self, file: &str) -> Result<Sha256Digest, String> {
        if let Some(known) = lock(&self.data).get(file) {
            return known.clone();
        }
        let read = File::open(self.folder.join(file)).and_then(Sha256Digest::read);
        let digest = read.map_err(|error| error.kind().to_string());
        lock(&self.data).insert(file.to_owned(), digest.clone());
        digest
    }
}

/// Whether an effect is a file rather than a name.
fn is_file(effect: &str) -> bool {
    Path::new(effect.trim()).extension().is_some_and(|ending| ending == "dgd")
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::syntax::tests::PLUS;

    fn identity() -> BuildIdentity {
        let text = |text: &str| text.to_owned();
        BuildIdentity {
            version: text("1"),
            build: text("b"),
            platform: text("p"),
            arithmetic: text("a"),
        }
    }

    const TANK: &str = "model tank\nimport \"gravity.dgd\"\nstate h [m] = 1\nder(h) = 0 [m/s]\n";

    #[test]
    fn a_name_is_that_of_build_model_data_and_options_and_of_nothing_else() {
        let place = tempfile::tempdir().expect("a folder for the test");
        let write = |name: &str, text: &str| {
            let path = place.path().join(name);
            fs::create_dir_all(path.parent().expect("below")).expect("the folder is writable");
            fs::write(path, text).expect("the folder is writable");
        };
        write("tank.dgd", TANK);
        write("gravity.dgd", "constant g [m/s^2] = 9.81\n");
        write("effects/leak.dgd", "effect leak on tank\n");
        write("more/other.dgd", "effect other on tank\n");
        write("a.csv", "time [s],h [m]\n0,1\n");
        write("b.csv", "time [s],h [m]\n0,2\n");
        let piece = |kind: PieceKind, options: &[&str]| Piece {
            well: "A".into(),
            when: "now".into(),
            kind,
            model: "tank.dgd".into(),
            data: vec!["a.csv".into()],
            valid: vec!["b.csv".into()],
            options: options.iter().map(|word| (*word).to_owned()).collect(),
            seed: 0,
        };
        let named = |piece: &Piece| PieceKeys::new(place.path(), &identity(), PLUS).key(piece);
        let fit = piece(PieceKind::Fit, &["+apply", "leak"]);
        let search = piece(PieceKind::Discover, &["+effects=more"]);
        let plain = piece(PieceKind::Fit, &[]);
        let pieces = [&fit, &search, &plain];
        let before = pieces.map(named);
        assert_eq!(before, pieces.map(named), "it is a function");
        assert!(before[0].len() == 32 && before[0] != before[1] && before[0] != before[2]);
        // A copy in another folder has the same names.
        let copy = tempfile::tempdir().expect("a folder for the test");
        let copied = std::process::Command::new("cp")
            .arg("-r")
            .arg(format!("{}/.", place.path().display()))
            .arg(copy.path())
            .status();
        if copied.is_ok_and(|status| status.success()) {
            assert_eq!(PieceKeys::new(copy.path(), &identity(), PLUS).key(&fit), before[0]);
        }
        // The names that change with each text.
        for (file, text, changes) in [
            ("tank.dgd", "model tank\n", [true, true, true]),
            ("gravity.dgd", "constant g [m/s^2] = 9.82\n", [true, true, true]),
            ("effects/leak.dgd", "effect leak on tank # \n", [true, true, false]),
            ("more/other.dgd", "effect other on tank # \n", [false, true, false]),
            ("a.csv", "time [s],h [m]\n0,1.1\n", [true, true, true]),
            ("b.csv", "time [s],h [m]\n0,2.1\n", [true, true, true]),
        ] {
            let kept = fs::read_to_string(place.path().join(file)).expect("it is there");
            write(file, text);
            let after = pieces.map(named);
            let changed = [0, 1, 2].map(|k| before[k] != after[k]);
            assert_eq!(changed, changes, "{file}");
            write(file, &kept);
        }
        assert_eq!(before, pieces.map(named));
        // And with each field of a piece.
        let others = [
            Piece { well: "B".into(), ..plain.clone() },
            Piece { when: "then".into(), ..plain.clone() },
            Piece { seed: 1, ..plain.clone() },
            Piece { kind: PieceKind::Profile { of: "x".into() }, ..plain.clone() },
            Piece { data: plain.valid.clone(), valid: plain.data.clone(), ..plain.clone() },
            Piece { data: vec!["missing.csv".into()], ..plain.clone() },
            piece(PieceKind::Fit, &["+rtol", "1e-8"]),
        ];
        let mut names: Vec<String> = others.iter().map(named).collect();
        names.push(before[2].clone());
        let other = BuildIdentity { build: "c".to_owned(), ..identity() };
        names.push(PieceKeys::new(place.path(), &other, PLUS).key(&plain));
        names.sort();
        names.dedup();
        assert_eq!(names.len(), others.len() + 2, "each has its own");
    }
}
