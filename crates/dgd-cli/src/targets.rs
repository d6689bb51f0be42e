//! Output files of a command: never a file that it reads, and checked before anything is computed.

use std::fs;
use std::path::{Path, PathBuf};

use dgd_compiler::source::SourceMap;
use dgd_data::files::journal::RunJournal;
use dgd_data::files::{try_folder, try_whole};
use dgd_data::open::STANDARD_INPUT;
use dgd_job::fleet;
use dgd_work::compare;
use dgd_work::discover;
use dgd_work::fit;
use dgd_work::screen;
use dgd_work::{Argument, ArgumentUse, UsageError, WorkError};

use crate::args::{Command, GlobalArgs, JobAction, JobArgs};
use crate::failure::CommandError;
use crate::picture;
use crate::table_file::{self, TableFormat};

/// The files that a command may write.
#[derive(Debug, Default)]
pub(crate) struct OutputTargets {
    all: Vec<OutputTarget>,
}

/// An output file, and the option that names it.
#[derive(Debug)]
struct OutputTarget {
    path: PathBuf,
    option: ArgumentUse,
}

/// The kind of `--out`.
enum OutKind {
    File,
    /// A file with a table.
    Table,
    /// A folder with files of these names.
    Folder(Vec<String>),
    /// The formatted file itself.
    Layout,
}

impl OutputTargets {
    /// Collects the output files of a command, and checks that they can be written and that none is also an input on
    /// the command line.
    pub(crate) fn verified(
        command: &Command,
        global: &GlobalArgs,
    ) -> Result<OutputTargets, CommandError> {
        let (read, plots) = (inputs(command), plots(command));
        let streams = read.iter().filter(|path| path.as_os_str() == STANDARD_INPUT).count();
        if streams > 1 {
            return Err(CommandError::Usage(
                "`-` is standard input, which can be read once: give files for the others"
                    .to_owned(),
            ));
        }
        picture::verify_formats(plots)?;
        let mut targets = OutputTargets::default();
        let mut add = |path: PathBuf, option: &ArgumentUse| {
            targets.all.push(OutputTarget { path, option: option.clone() });
        };
        let out = global.out.as_deref().map(|path| (path, out(command)));
        if let Some((path, out)) = &out {
            let option = Argument::Out.with(path.display());
            match out {
                OutKind::File | OutKind::Layout => add(path.to_path_buf(), &option),
                OutKind::Table => {
                    add(path.to_path_buf(), &option);
                    add(table_file::partial_path(path), &option);
                }
                OutKind::Folder(names) => {
                    for name in names {
                        add(path.join(name), &option);
                    }
                    add(RunJournal::path(path), &option);
                }
            }
        }
        for path in plots {
            add(path.clone(), &Argument::Plot.with(path.display()));
        }
        targets.spare_all(&read)?;
        match &out {
            Some((path, OutKind::Table)) => {
                TableFormat::from_path(path, global.format)?;
            }
            // An existing folder may have any name.
            Some((path, OutKind::Folder(_)))
                if TableFormat::named(path).is_some() && !path.exists() =>
            {
                return Err(CommandError::Usage(format!(
                    "`-o {}`: this command writes a folder, and the name is that of a file",
                    path.display()
                )));
            }
            Some((path, OutKind::File | OutKind::Layout))
                if TableFormat::named(path) == Some(TableFormat::Parquet) =>
            {
                return Err(CommandError::Usage(format!(
                    "`-o {}`: the result of this command is not a table, so it cannot be Parquet",
                    path.display()
                )));
            }
            _ => {}
        }
        Self::verify_distinct(out.as_ref().map(|(path, _)| *path), plots)?;
        match &out {
            Some((path, OutKind::File | OutKind::Table | OutKind::Layout)) => try_whole(path)?,
            Some((path, OutKind::Folder(_))) => try_folder(path)?,
            None => {}
        }
        plots.iter().try_for_each(|path| try_whole(path))?;
        Ok(targets)
    }

    /// Checks that none of them was read meanwhile, as an import or an effect.
    pub(crate) fn spare(&self, sources: &SourceMap) -> Result<(), WorkError> {
        let read: Vec<PathBuf> =
            sources.files().map(|source| PathBuf::from(&source.name)).collect();
        self.spare_all(&read)
    }

    fn spare_all(&self, read: &[PathBuf]) -> Result<(), WorkError> {
        if self.all.is_empty() {
            return Ok(());
        }
        let read: Vec<(&PathBuf, FileIdentity)> =
            read.iter().filter_map(|path| Some((path, identity(path)?))).collect();
        for OutputTarget { path, option } in &self.all {
            let Some(target) = identity(path) else { continue };
            if let Some((input, _)) = read.iter().find(|(_, input)| *input == target) {
                let (by, path) = (option.clone(), input.to_path_buf());
                return Err(UsageError::Replaces { by, path }.into());
            }
        }
        Ok(())
    }

    /// Checks that figures do not replace the result.
    fn verify_distinct(out: Option<&Path>, plots: &[PathBuf]) -> Result<(), CommandError> {
        let place = |path: &Path| {
            let name = path.file_name()?.to_owned();
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
            Some(fs::canonicalize(folder.unwrap_or(Path::new("."))).ok()?.join(name))
        };
        let out = out.and_then(place);
        match plots.iter().find(|path| out.is_some() && place(path) == out) {
            Some(path) => Err(CommandError::Usage(format!(
                "`-o` and `--plot` are both `{}`: give two names",
                path.display()
            ))),
            None => Ok(()),
        }
    }
}

/// Identity of the file behind a path: the same for all its names and links.
#[cfg(unix)]
type FileIdentity = (u64, u64);
#[cfg(not(unix))]
type FileIdentity = PathBuf;

/// Identity of the regular file behind a path, if there is one.
fn identity(path: &Path) -> Option<FileIdentity> {
    let file = fs::metadata(path).ok().filter(fs::Metadata::is_file)?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        Some((file.dev(), file.ino()))
    }
    #[cfg(not(unix))]
    {
        let _ = file;
        fs::canonicalize(path).ok()
    }
}

/// Input files on the command line.
fn inputs(command: &Command) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> = Vec::new();
    let choices = match command {
        Command::Check(args) => {
            paths.push(args.model.clone());
            Some(&args.choices)
        }
        Command::Fmt(_)
        | Command::Explain(_)
        | Command::Methods
        | Command::Schema
        | Command::Completions(_)
        | Command::Man(_)
        | Command::Lsp(_) => None,
        Command::Job(args) => {
            paths.extend(job_file(args).cloned());
            None
        }
        Command::New(args) => {
            paths.extend(args.from.clone());
            None
        }
        Command::Adopt(args) => {
            paths.push(args.result.clone());
            None
        }
        Command::Emit(args) => {
            paths.push(args.model.clone());
            Some(&args.choices)
        }
        Command::Simulate(args) => {
            paths.push(args.run.model.clone());
            paths.extend(args.run.data.iter().chain(&args.ensemble).cloned());
            Some(&args.run.choices)
        }
        Command::Watch(args) => {
            paths.push(args.run.model.clone());
            paths.extend(args.run.data.clone());
            Some(&args.run.choices)
        }
        Command::Sensitivity(args) => {
            paths.push(args.run.model.clone());
            paths.extend(args.run.data.clone());
            Some(&args.run.choices)
        }
        Command::Linearize(args) => {
            paths.push(args.model.clone());
            paths.extend(args.data.clone());
            Some(&args.choices)
        }
        Command::Invert(args) => {
            paths.push(args.model.clone());
            paths.push(args.data.clone());
            Some(&args.choices)
        }
        Command::Fit(args) => {
            paths.push(args.model.clone());
            paths.extend(args.given.all().cloned());
            Some(&args.choices)
        }
        Command::Compare(args) => {
            paths.extend(args.contenders.iter().map(|one| compare::model_of(one)));
            paths.extend(args.given.all().cloned());
            None
        }
        Command::Track(args) => {
            paths.push(args.model.clone());
            let is_stream = args.data == Path::new("-");
            paths.push(if is_stream { "/dev/stdin".into() } else { args.data.clone() });
            Some(&args.choices)
        }
        Command::Discover(args) => {
            paths.push(args.model.clone());
            paths.extend(args.given.all().cloned());
            Some(&args.choices)
        }
        Command::Screen(args) => {
            paths.extend(args.model.iter().chain(&args.data).cloned());
            Some(&args.choices)
        }
    };
    let effects = choices.into_iter().flat_map(|choices| &choices.apply);
    paths.extend(effects.map(|effect| effect.split('(').next().unwrap_or_default().trim().into()));
    paths
}

/// The job file of a command.
fn job_file(args: &JobArgs) -> Option<&PathBuf> {
    match &args.action {
        JobAction::Run(args) => Some(&args.place.job),
        JobAction::Status(args) | JobAction::Report(args) | JobAction::Tasks(args) => {
            Some(&args.job)
        }
        JobAction::Work => None,
    }
}

/// Image files on the command line.
fn plots(command: &Command) -> &[PathBuf] {
    match command {
        Command::Check(_)
        | Command::Fmt(_)
        | Command::Emit(_)
        | Command::Explain(_)
        | Command::Methods
        | Command::Schema
        | Command::Completions(_)
        | Command::Man(_)
        | Command::New(_)
        | Command::Lsp(_)
        | Command::Job(_)
        | Command::Adopt(_) => &[],
        Command::Simulate(args) => &args.run.solve.plot,
        Command::Sensitivity(args) => &args.run.solve.plot,
        Command::Watch(args) => &args.run.solve.plot,
        Command::Linearize(args) => &args.solve.plot,
        Command::Invert(args) => &args.solve.plot,
        Command::Fit(args) => &args.solve.plot,
        Command::Compare(args) => &args.solve.plot,
        Command::Track(args) => &args.solve.plot,
        Command::Discover(args) => &args.solve.plot,
        Command::Screen(args) => &args.plot,
    }
}

fn out(command: &Command) -> OutKind {
    match command {
        Command::Job(JobArgs { action: JobAction::Report(_) }) => {
            OutKind::Folder(fleet::FILES.map(str::to_owned).to_vec())
        }
        Command::Check(_)
        | Command::Emit(_)
        | Command::Explain(_)
        | Command::Methods
        | Command::Schema
        | Command::Completions(_)
        | Command::Man(_)
        | Command::New(_)
        | Command::Lsp(_)
        | Command::Watch(_)
        | Command::Job(_)
        | Command::Adopt(_) => OutKind::File,
        Command::Fmt(_) => OutKind::Layout,
        Command::Simulate(_)
        | Command::Sensitivity(_)
        | Command::Linearize(_)
        | Command::Invert(_)
        | Command::Track(_) => OutKind::Table,
        Command::Fit(args) => OutKind::Folder(fit::file_names(&args.model)),
        Command::Compare(_) => OutKind::Folder(compare::FILES.map(str::to_owned).to_vec()),
        Command::Discover(args) => OutKind::Folder(discover::file_names(&args.model)),
        Command::Screen(_) => OutKind::Folder(screen::FILES.map(str::to_owned).to_vec()),
    }
}
