//! `dgd adopt`: puts a described formula or effect of a discovery into the library of its model.

use dgd_data::files::write_whole;
use dgd_work::{AdoptRequest, adopt};

use crate::console::Console;
use crate::failure::CommandError;

pub(crate) fn run(request: &AdoptRequest, console: Console<'_>) -> Result<(), CommandError> {
    let adopted = adopt(request, console.session())?;
    if let Some(out) = console.out() {
        write_whole(out, |file| file.write_all(adopted.text.as_bytes()))?;
        console.remark(&format!("wrote {}", out.display()));
        return Ok(());
    }
    if let Some(folder) = adopted.path.parent() {
        std::fs::create_dir_all(folder).map_err(|error| {
            CommandError::Found(format!("cannot make the folder `{}`: {error}", folder.display()))
        })?;
    }
    write_whole(&adopted.path, |file| file.write_all(adopted.text.as_bytes()))?;
    console.remark(&format!(
        "wrote {}: `dgd discover` and `--apply {}` find it there",
        adopted.path.display(),
        adopted.name
    ));
    Ok(())
}
