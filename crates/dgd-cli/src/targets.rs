//! Output files of a command: never a file that it reads, and checked before anything is computed.

use std::fs;
use std::path::{Path, PathBuf};

use dgd_compiler::source::SourceMap;
use dgd_data::files::journal::RunJournal;
use dgd_data::files::{try_folder, try_whole};
use dgd_data::open::STANDARD_INPUT;
use dgd_data::write::TableFormat;
use dgd_job::fleet;
use dgd_work::ModelChoices;
use dgd_work::compare;
use dgd_work::discover;
use dgd_work::fit;
use dgd_work::screen;
use dgd_work::{Argument, ArgumentUse, UsageError, WorkError};

use crate::args::{Command, GlobalArgs, JobAction, JobArgs};
use crate::failure::CommandError;
use crate::picture;
use crate::table_file;

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
        command: &CommandFiles<'_>,
        global: &GlobalArgs,
    ) -> Result<OutputTargets, CommandError> {
        let CommandFiles { read, plots, out, .. } = command;
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
        let out = global.out.as_deref().map(|path| (path, out));
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
        for path in *plots {
            add(path.clone(), &Argument::Plot.with(path.display()));
        }
        targets.spare_all(read)?;
        match &out {
            Some((path, OutKind::Table)) => {
                table_file::table_format(path, global.format)?;
            }
            // An existing folder may have any name.
            Some((path, OutKind::Folder(_)))
                if TableFormat::from_path(path).is_some() && !path.exists() =>
            {
                return Err(CommandError::Usage(format!(
                    "`-o {}`: this command writes a folder, and the name is that of a file",
                    path.display()
                )));
            }
            Some((path, OutKind::File | OutKind::Layout))
                if TableFormat::from_path(path) == Some(TableFormat::Parquet) =>
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
                let (by, path) = (option.clone(), PathBuf::clone(input));
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

/// What a command reads and writes, and how it ends.
pub(crate) struct CommandFiles<'a> {
    /// Input files on the command line.
    read: Vec<PathBuf>,
    /// Image files on the command line.
    plots: &'a [PathBuf],
    out: OutKind,
    /// Whether the command handles Ctrl-C by itself once its computation has begun.
    pub handles_ctrl_c: bool,
}

impl<'a> CommandFiles<'a> {
    pub(crate) fn new(command: &'a Command) -> Self {
        match command {
            Command::Check(args) => Self::of_model(&args.request.model, &args.request.choices),
            Command::Emit(args) => Self::of_model(&args.model, &args.choices),
            Command::Fmt(_) => Self::to(OutKind::Layout),
            Command::Explain(_)
            | Command::Methods
            | Command::Schema
            | Command::Completions(_)
            | Command::Man(_)
            | Command::Lsp(_) => Self::to(OutKind::File),
            Command::New(args) => Self::to(OutKind::File).reading(&args.from),
            Command::Adopt(request) => Self::to(OutKind::File).reading([&request.result]),
            Command::Job(args) => Self::of_job(args),
            Command::Simulate(args) => {
                let run = &args.request.run;
                let files = Self::of_model(&run.model, &run.choices).drawing(&args.plot);
                files
                    .reading(run.data.iter().chain(&args.request.ensemble))
                    .computing(OutKind::Table)
            }
            Command::Watch(args) => {
                let run = &args.run.request;
                Self::of_model(&run.model, &run.choices).drawing(&args.run.plot).reading(&run.data)
            }
            Command::Sensitivity(args) => {
                let run = &args.request.run;
                let files = Self::of_model(&run.model, &run.choices).drawing(&args.plot);
                files.reading(&run.data).computing(OutKind::Table)
            }
            Command::Linearize(args) => {
                let request = &args.request;
                let files = Self::of_model(&request.model, &request.choices).drawing(&args.plot);
                files.reading(&request.data).computing(OutKind::Table)
            }
            Command::Invert(args) => {
                let request = &args.request;
                let files = Self::of_model(&request.model, &request.choices).drawing(&args.plot);
                files.reading([&request.data]).computing(OutKind::Table)
            }
            Command::Fit(args) => {
                let request = &args.request;
                let files = Self::of_model(&request.model, &request.choices).drawing(&args.plot);
                let names = fit::file_names(&request.model);
                files
                    .reading(request.data.iter().chain(&request.valid))
                    .computing(OutKind::Folder(names))
            }
            Command::Compare(args) => {
                let request = &args.request;
                let models: Vec<PathBuf> =
                    request.contenders.iter().map(|one| compare::model_of(one)).collect();
                let files = Self::to(OutKind::File).drawing(&args.plot).reading(&models);
                files
                    .reading(request.data.iter().chain(&request.valid))
                    .computing(OutKind::Folder(compare::FILES.map(str::to_owned).to_vec()))
            }
            // Its rows are complete one by one, so Ctrl-C may end it at any time.
            Command::Track(args) => {
                let request = &args.request;
                let is_stream = request.data == Path::new("-");
                let data = if is_stream { Path::new("/dev/stdin") } else { &request.data };
                let files = Self::of_model(&request.model, &request.choices).drawing(&args.plot);
                Self { out: OutKind::Table, ..files.reading([&data.to_owned()]) }
            }
            Command::Discover(args) => {
                let request = &args.request;
                let files = Self::of_model(&request.model, &request.choices).drawing(&args.plot);
                let names = discover::file_names(&request.model);
                files
                    .reading(request.data.iter().chain(&request.valid))
                    .computing(OutKind::Folder(names))
            }
            Command::Screen(args) => {
                let request = &args.request;
                let files = Self::to(OutKind::File).applying(&request.choices).drawing(&args.plot);
                files
                    .reading(request.model.iter().chain(&request.data))
                    .computing(OutKind::Folder(screen::FILES.map(str::to_owned).to_vec()))
            }
        }
    }

    fn to(out: OutKind) -> Self {
        CommandFiles { read: Vec::new(), plots: &[], out, handles_ctrl_c: false }
    }

    fn of_model(model: &PathBuf, choices: &ModelChoices) -> Self {
        Self::to(OutKind::File).reading([model]).applying(choices)
    }

    fn of_job(args: &JobArgs) -> Self {
        let files = Self::to(OutKind::File).reading(job_file(args));
        match &args.action {
            JobAction::Run(_) => files.computing(OutKind::File),
            JobAction::Report(_) => {
                Self { out: OutKind::Folder(fleet::FILES.map(str::to_owned).to_vec()), ..files }
            }
            JobAction::Status(_) | JobAction::Tasks(_) | JobAction::Work => files,
        }
    }

    fn reading<'p>(mut self, paths: impl IntoIterator<Item = &'p PathBuf>) -> Self {
        self.read.extend(paths.into_iter().cloned());
        self
    }

    /// Effects may be files.
    fn applying(mut self, choices: &ModelChoices) -> Self {
        let file = |effect: &String| effect.split('(').next().unwrap_or_default().trim().into();
        self.read.extend(choices.apply.iter().map(file));
        self
    }

    fn drawing(self, plots: &'a [PathBuf]) -> Self {
        Self { plots, ..self }
    }

    /// A command that ends its computation by itself at Ctrl-C.
    fn computing(self, out: OutKind) -> Self {
        Self { out, handles_ctrl_c: true, ..self }
    }
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
