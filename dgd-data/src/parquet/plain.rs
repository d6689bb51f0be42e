//! Reads Parquet files as dgd writes them: columns of doubles and texts, plain and uncompressed.

use super::thrift::{Value, decode};
use super::{Cells, MAGIC, Place, TakesColumns, Unread};
use crate::parquet::write::{BYTE_ARRAY, DATA_PAGE, DOUBLE, OPTIONAL, PLAIN, RLE, UNCOMPRESSED};

/// Reads a file column by column within groups of rows.
pub(super) fn read(place: &Place, table: &mut dyn TakesColumns) -> Result<(), Unread> {
    let length = place.len()?;
    let end = description(place, length)?;
    let description = decode(&end).filter(|(_, rest)| rest.is_empty()).ok_or_else(damaged)?.0;
    let columns = columns(&description)?;
    // A row takes at least one byte, except in rows without values.
    let mut room = usize::try_from(length).map_err(|_| damaged())?;
    let mut groups = Vec::new();
    for group in description.list(4).ok_or_else(damaged)? {
        let n_rows = group.integer(3).and_then(|n| usize::try_from(n).ok()).ok_or_else(damaged)?;
        room = room.checked_sub(n_rows).ok_or_else(damaged)?;
        let chunks = group.list(1).filter(|chunks| chunks.len() == columns.len());
        groups.push((n_rows, chunks.ok_or_else(damaged)?));
    }
    let names: Vec<String> = columns.iter().map(|column| column.name.to_owned()).collect();
    let n_rows = groups.iter().map(|(n_rows, _)| n_rows).sum();
    let Some(wanted) = table.begin(&names, n_rows, length) else { return Ok(()) };
    for (at, column) in columns.iter().enumerate().filter(|(at, _)| wanted[*at]) {
        for (n_rows, chunks) in &groups {
            chunk(place, &chunks[at], column, *n_rows, &mut |cells| table.take(at, cells))?;
        }
    }
    Ok(())
}

fn damaged() -> Unread {
    "the file is damaged".to_owned().into()
}

fn another_kind() -> Unread {
    Unread {
        why: "it is a Parquet file of a kind that this build does not read".to_owned(),
        help: Some("write it as `.csv`, or build dgd with `--features parquet`"),
    }
}

/// The metadata at the end of the file.
fn description(place: &Place, length: u64) -> Result<Vec<u8>, Unread> {
    let tail = MAGIC.len() as u64 + 4;
    let position = length.checked_sub(tail).ok_or_else(damaged)?;
    let bytes = place.bytes(position, 4)?;
    let size = u32::from_le_bytes(bytes.try_into().map_err(|_| damaged())?);
    let begin = position.checked_sub(size.into()).filter(|begin| *begin >= MAGIC.len() as u64);
    if !place.is_parquet() {
        return Err(damaged());
    }
    Ok(place.bytes(begin.ok_or_else(damaged)?, size as usize)?)
}

struct Column<'a> {
    name: &'a str,
    kind: i64,
    is_optional: bool,
}

fn columns<'a>(description: &Value<'a>) -> Result<Vec<Column<'a>>, Unread> {
    let schema = description.list(2).ok_or_else(damaged)?;
    let fields = schema.get(1..).filter(|fields| !fields.is_empty()).ok_or_else(damaged)?;
    let column = |field: &Value<'a>| {
        // Groups, lists, and numbers with a logical type are not supported.
        let is_group = field.integer(5).is_some_and(|n| n > 0);
        let kind = field.integer(1);
        let means_more = kind == Some(DOUBLE.into()) && field.field(6).is_some();
        let repetition = field.integer(3).unwrap_or_default();
        let is_known = kind.is_some_and(|kind| [DOUBLE, BYTE_ARRAY].map(i64::from).contains(&kind));
        match kind {
            Some(kind)
                if is_known && !is_group && !means_more && repetition <= i64::from(OPTIONAL) =>
            {
                let name = field.text(4).ok_or_else(damaged)?;
                Ok(Column { name, kind, is_optional: repetition == i64::from(OPTIONAL) })
            }
            _ => Err(another_kind()),
        }
    };
    fields.iter().map(column).collect()
}

/// Size limit of a page header, in bytes.
const HEAD: u64 = 1 << 16;

/// Reads a column of a group of rows, page by page.
fn chunk(
    place: &Place,
    chunk: &Value<'_>,
    column: &Column<'_>,
    n_rows: usize,
    take: &mut dyn FnMut(Cells),
) -> Result<(), Unread> {
    let data = chunk.field(3).ok_or_else(damaged)?;
    if data.integer(4) != Some(UNCOMPRESSED.into()) || data.field(11).is_some() {
        return Err(another_kind());
    }
    let start = data.integer(9).and_then(|at| u64::try_from(at).ok());
    let (mut at, length) = (start.ok_or_else(damaged)?, place.len()?);
    let mut left = n_rows;
    while left > 0 {
        let room = length.checked_sub(at).ok_or_else(damaged)?;
        let head = place.bytes(at, room.min(HEAD) as usize)?;
        let (header, behind) = decode(&head).ok_or_else(damaged)?;
        let page = header.field(5).ok_or_else(another_kind)?;
        let is_plain = header.integer(1) == Some(DATA_PAGE.into())
            && page.integer(2) == Some(PLAIN.into())
            && (!column.is_optional || page.integer(3) == Some(RLE.into()));
        if !is_plain {
            return Err(another_kind());
        }
        at += (head.len() - behind.len()) as u64;
        let size = header.integer(3).and_then(|size| u64::try_from(size).ok());
        let size = size.filter(|size| *size <= length - at).ok_or_else(damaged)?;
        let bytes = place.bytes(at, size as usize)?;
        at += size;
        let count = page.integer(1).and_then(|count| usize::try_from(count).ok());
        let count = count.filter(|n| (1..=left).contains(n)).ok_or_else(damaged)?;
        take(page_cells(&bytes, column, count)?);
        left -= count;
    }
    Ok(())
}

fn page_cells(mut bytes: &[u8], column: &Column<'_>, count: usize) -> Result<Cells, Unread> {
    let mut runs = vec![(true, count)];
    if column.is_optional {
        let (length, rest) = bytes.split_first_chunk::<4>().ok_or_else(damaged)?;
        let length = u32::from_le_bytes(*length) as usize;
        let (levels, rest) = rest.split_at_checked(length).ok_or_else(damaged)?;
        (runs, bytes) = (runs_of(levels)?, rest);
    }
    if column.kind == i64::from(DOUBLE) {
        Ok(Cells::Numbers(optional(&runs, count, || number(&mut bytes), f64::NAN)?))
    } else {
        Ok(Cells::Texts(optional(&runs, count, || text(&mut bytes), String::new())?))
    }
}

/// Values by runs, with `missing` for absent ones.
fn optional<T: Clone>(
    runs: &[(bool, usize)],
    count: usize,
    mut next: impl FnMut() -> Option<T>,
    missing: T,
) -> Result<Vec<T>, Unread> {
    let mut values = Vec::new();
    for (there, n) in runs {
        let n = (*n).min(count - values.len());
        for _ in 0..n {
            values.push(if *there { next().ok_or_else(damaged)? } else { missing.clone() });
        }
    }
    if values.len() == count { Ok(values) } else { Err(damaged()) }
}

/// Runs of present and missing values.
fn runs_of(mut levels: &[u8]) -> Result<Vec<(bool, usize)>, Unread> {
    let mut runs = Vec::new();
    while !levels.is_empty() {
        let (mut header, mut shift) = (0_usize, 0);
        loop {
            let (byte, rest) = levels.split_first().ok_or_else(damaged)?;
            levels = rest;
            header |= usize::from(byte & 0x7f) << shift;
            shift += 7;
            match byte {
                0..0x80 => break,
                _ if shift > 28 => return Err(damaged()),
                _ => {}
            }
        }
        // A bit-packed run, which other writers may use.
        if header & 1 == 1 {
            let (bits, rest) = levels.split_at_checked(header >> 1).ok_or_else(damaged)?;
            levels = rest;
            let bit = |at: usize| bits[at / 8] >> (at % 8) & 1 == 1;
            runs.extend((0..8 * bits.len()).map(|at| (bit(at), 1)));
        } else {
            let (there, rest) = levels.split_first().ok_or_else(damaged)?;
            levels = rest;
            runs.push((*there == 1, header >> 1));
        }
    }
    Ok(runs)
}

fn number(bytes: &mut &[u8]) -> Option<f64> {
    let (number, rest) = bytes.split_first_chunk::<8>()?;
    *bytes = rest;
    Some(f64::from_le_bytes(*number))
}

fn text(bytes: &mut &[u8]) -> Option<String> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    let (text, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    *bytes = rest;
    str::from_utf8(text).ok().map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;
    use crate::parquet::{ParquetWriter, Text, written};

    fn to_csv(file: &[u8]) -> Result<String, Unread> {
        let mut text = Text::default();
        super::read(&Place::Memory(file.to_vec()), &mut text)?;
        Ok(text.to_csv())
    }

    fn read(file: &[u8]) -> Result<String, String> {
        to_csv(file).map_err(|unread| unread.why)
    }

    const TABLE: &str = "time [s],\"q, \"\"a\"\" [lpm]\",unit\n\
                         0,0.1,1\n1e-300,NaN,1/s\n2,NaN,\"a,b\"\n3,-inf,\n4,-0,x\n";

    #[test]
    fn a_table_is_read_as_it_was_written() {
        assert_eq!(read(&written(TABLE)).as_deref(), Ok(TABLE));
        // Several groups of rows, and runs of missing values whose length does not fit into a byte.
        let cell = |i: i32| if i / 1000 % 2 == 0 { "NaN".to_owned() } else { i.to_string() };
        let row = |i: i32| format!("{i},{}\n", vec![cell(i); 60].join(","));
        let names: Vec<String> = (0..60).map(|j| format!(",c{j}")).collect();
        let head = names.concat();
        let long = format!("time [s]{head}\n{}", (0..50_000).map(row).collect::<String>());
        assert!(read(&written(&long)).as_deref() == Ok(long.as_str()));
        assert_eq!(read(&written("x [m]\n")).as_deref(), Ok("x [m]\n"));
    }

    #[test]
    fn a_text_among_numbers_of_an_earlier_group_is_not_dropped() {
        let mut out = Vec::new();
        let mut writer = ParquetWriter::new(&mut out);
        let text = format!("x\n{}a\n", "1\n".repeat(1 << 21));
        writer.write_all(text.as_bytes()).expect("to memory");
        let error = writer.finish().expect_err("a column is of one kind").to_string();
        assert_eq!(error, "column `x` holds numbers, and then a text");
    }

    #[test]
    fn a_damaged_file_is_refused_or_read_and_never_makes_it_panic() {
        let file = written(TABLE);
        for length in 0..file.len() {
            assert!(read(&file[..length]).is_err(), "{length}");
        }
        for at in 0..file.len() {
            for flip in [0x01, 0x10, 0x80, 0xff] {
                let mut damaged = file.clone();
                damaged[at] ^= flip;
                let _ = read(&damaged);
            }
        }
    }

    #[test]
    fn what_only_the_library_reads_is_said_to_be_so() {
        // The codec of the first column: field 4 after its path.
        let file = written("x [m]\n1\n");
        let position =
            file.windows(6).rposition(|bytes| bytes[..5] == *b"x [m]" && bytes[5] == 0x15);
        let mut compressed = file;
        compressed[position.expect("a path and a codec") + 6] = 2;
        let unread = to_csv(&compressed).expect_err("compressed by Snappy");
        assert_eq!(unread.why, "it is a Parquet file of a kind that this build does not read");
        assert!(unread.help.is_some_and(|help| help.contains("--features parquet")));
    }
}
