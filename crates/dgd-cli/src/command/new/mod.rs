//! `dgd new`: starts a project from a template or from the columns of a recording.

mod names;
mod skeleton;
mod templates;
#[cfg(test)]
mod tests;

use std::fs;
use std::io::Read;
use std::path::Path;

use dgd_data::files::{ResultFolder, write_folder};
use dgd_data::{DiskFiles, FileSystem, decompressed};

use crate::args::NewArgs;
use crate::console::Console;
use crate::failure::CommandError;
use templates::{ProjectTemplate, TEMPLATES};

/// Bytes of the largest recording that is copied into a project.
const MOST_BYTES: u64 = 1 << 30;

pub(crate) fn run(args: &NewArgs, console: Console<'_>) -> Result<(), CommandError> {
    if console.out().is_some() {
        let message = "`dgd new` writes the folder that it is given: leave `-o` out";
        return Err(CommandError::Usage(message.to_owned()));
    }
    let folder = &args.name;
    if fs::symlink_metadata(folder).is_ok() {
        return Err(CommandError::Found(format!(
            "`{}` is there already: give another name",
            folder.display()
        )));
    }
    let (files, remarks) = match (&args.template, &args.from) {
        (Some(name), _) => {
            let template = TEMPLATES.iter().find(|one| one.name == name);
            let template = template.unwrap_or_else(|| unreachable!("clap knows the templates"));
            (of_template(template), Vec::new())
        }
        (None, Some(path)) => {
            let stem = folder.file_name().map(|name| name.to_string_lossy().into_owned());
            let model = names::identifier(&stem.unwrap_or_default(), "model");
            let bytes = bytes_of(path)?;
            let skeleton = skeleton::build(&model, path, &bytes, &args.outputs)?;
            (skeleton.files, skeleton.remarks)
        }
        (None, None) => unreachable!("clap asks for one of them"),
    };
    write_folder(folder, &files)?;
    for remark in &remarks {
        console.remark(remark);
    }
    console.remark(&format!(
        "wrote {}: {} has five commands to go on with",
        folder.display(),
        folder.join("README.md").display()
    ));
    Ok(())
}

/// The bytes of a recording, which may come from standard input and may be compressed.
fn bytes_of(path: &Path) -> Result<Vec<u8>, CommandError> {
    let failed =
        |why: String| CommandError::Found(format!("cannot read `{}`: {why}", path.display()));
    let mut bytes = Vec::new();
    let file = DiskFiles.open(path).map_err(failed)?;
    let file = decompressed(file).map_err(|error| failed(error.to_string()))?;
    file.take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(|error| failed(error.to_string()))?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(failed(format!("it is larger than {} GB", MOST_BYTES >> 30)));
    }
    Ok(bytes)
}

/// The files of a template's project.
fn of_template(template: &ProjectTemplate) -> ResultFolder {
    let ProjectTemplate { about, model, text, effects, recordings: [train, valid], truth, .. } =
        template;
    let title = format!("# {model}\n\n{about}\n\n");
    let story = "The model is right but for one effect that the recordings have and it lacks. Five commands find it:\n\n";
    let commands = commands(model, "train.csv", Some("valid.csv"));
    let end = "\nThe recordings were made by a simulator that shares no code with dgd; `truth.json` says what is hidden. The other\n\
        files in `effects` are its rivals. Then try your own: change the model, or write another effect.\n";
    let mut written: Vec<(String, Vec<u8>)> = vec![
        (format!("{model}.dgd"), text.as_bytes().to_vec()),
        ("train.csv".to_owned(), train.to_vec()),
        ("valid.csv".to_owned(), valid.to_vec()),
        ("truth.json".to_owned(), truth.as_bytes().to_vec()),
        ("README.md".to_owned(), format!("{title}{story}{commands}{end}").into_bytes()),
    ];
    let effects = effects.iter();
    written.extend(
        effects.map(|(name, text)| (format!("effects/{name}.dgd"), text.as_bytes().to_vec())),
    );
    ResultFolder { written, removed: Vec::new() }
}

/// Five commands to try next; the last plots the result on the recording that it was fitted to.
fn commands(model: &str, data: &str, valid: Option<&str>) -> String {
    let file = format!("{model}.dgd");
    let valid_option = valid.map(|path| format!(" --valid {path}")).unwrap_or_default();
    format!(
        "```sh\n\
         dgd check {file}\n\
         dgd simulate {file} --data {data} --plot first.html\n\
         dgd fit {file} --data {data}{valid_option} -o fitted\n\
         dgd discover {file} --data {data}{valid_option} -o found\n\
         dgd simulate found/{file} --data {data} --plot found.html\n\
         ```\n"
    )
}
