//! Thrift's compact protocol, the encoding of Parquet metadata.

/// Types of fields and elements.
pub(super) const I32: u8 = 5;
const I64: u8 = 6;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const STRUCT: u8 = 12;

/// Writes structs field by field.
#[derive(Debug, Default)]
pub(super) struct Encoder {
    pub(super) bytes: Vec<u8>,
    /// The last field of each enclosing open struct.
    outer: Vec<i16>,
    last: i16,
}

impl Encoder {
    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.bytes.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.bytes.push(value as u8);
    }

    fn integer(&mut self, value: i64) {
        self.varint(((value << 1) ^ (value >> 63)) as u64);
    }

    fn field(&mut self, id: i16, kind: u8) {
        let step = id - self.last;
        if (1..16).contains(&step) {
            self.bytes.push((step as u8) << 4 | kind);
        } else {
            self.bytes.push(kind);
            self.integer(id.into());
        }
        self.last = id;
    }

    pub(super) fn i32(&mut self, id: i16, value: i32) {
        self.field(id, I32);
        self.integer(value.into());
    }

    pub(super) fn i64(&mut self, id: i16, value: i64) {
        self.field(id, I64);
        self.integer(value);
    }

    pub(super) fn text(&mut self, id: i16, text: &str) {
        self.field(id, BINARY);
        self.text_element(text);
    }

    pub(super) fn text_element(&mut self, text: &str) {
        self.varint(text.len() as u64);
        self.bytes.extend_from_slice(text.as_bytes());
    }

    pub(super) fn i32_element(&mut self, value: i32) {
        self.integer(value.into());
    }

    fn list(&mut self, id: i16, kind: u8, length: usize) {
        self.field(id, LIST);
        if length < 15 {
            self.bytes.push((length as u8) << 4 | kind);
        } else {
            self.bytes.push(0xf0 | kind);
            self.varint(length as u64);
        }
    }

    /// A list of integers.
    pub(super) fn integers(&mut self, id: i16, values: &[i32]) {
        self.list(id, I32, values.len());
        for value in values {
            self.i32_element(*value);
        }
    }

    /// A list of texts.
    pub(super) fn texts(&mut self, id: i16, texts: &[&str]) {
        self.list(id, BINARY, texts.len());
        for text in texts {
            self.text_element(text);
        }
    }

    /// A list of structs.
    pub(super) fn structs<T>(
        &mut self,
        id: i16,
        elements: &[T],
        mut write: impl FnMut(&mut Self, &T),
    ) {
        self.list(id, STRUCT, elements.len());
        for element in elements {
            self.whole(|encoder| write(encoder, element));
        }
    }

    pub(super) fn structure(&mut self, id: i16, write: impl FnOnce(&mut Self)) {
        self.field(id, STRUCT);
        self.whole(write);
    }

    /// A top-level struct.
    pub(super) fn whole(&mut self, write: impl FnOnce(&mut Self)) {
        self.outer.push(self.last);
        self.last = 0;
        write(self);
        self.bytes.push(0);
        self.last = self.outer.pop().unwrap_or_default();
    }
}

/// A decoded value.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value<'a> {
    Integer(i64),
    Bytes(&'a [u8]),
    List(Vec<Value<'a>>),
    Struct(Vec<(i16, Value<'a>)>),
    /// A value of an unused type.
    Other,
}

impl<'a> Value<'a> {
    pub(super) fn field(&self, id: i16) -> Option<&Value<'a>> {
        match self {
            Value::Struct(fields) => {
                fields.iter().find(|(found, _)| *found == id).map(|(_, value)| value)
            }
            _ => None,
        }
    }

    pub(super) fn integer(&self, id: i16) -> Option<i64> {
        match self.field(id)? {
            Value::Integer(value) => Some(*value),
            _ => None,
        }
    }

    pub(super) fn text(&self, id: i16) -> Option<&'a str> {
        match self.field(id)? {
            Value::Bytes(bytes) => str::from_utf8(bytes).ok(),
            _ => None,
        }
    }

    pub(super) fn list(&self, id: i16) -> Option<&[Value<'a>]> {
        match self.field(id)? {
            Value::List(values) => Some(values),
            _ => None,
        }
    }
}

/// Decodes a struct, and returns the rest; `None` for invalid bytes.
pub(super) fn decode(bytes: &[u8]) -> Option<(Value<'_>, &[u8])> {
    let mut decoder = Decoder { bytes };
    let value = decoder.value(STRUCT, 0)?;
    Some((value, decoder.bytes))
}

struct Decoder<'a> {
    bytes: &'a [u8],
}

/// Maximum nesting of structs and lists; files written by dgd have six levels.
const DEEPEST: usize = 32;

impl<'a> Decoder<'a> {
    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.bytes.split_at_checked(length)?;
        self.bytes = rest;
        Some(taken)
    }

    fn byte(&mut self) -> Option<u8> {
        self.take(1).map(|bytes| bytes[0])
    }

    fn varint(&mut self) -> Option<u64> {
        let mut value = 0_u64;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(value);
            }
        }
        None
    }

    fn integer(&mut self) -> Option<i64> {
        let value = self.varint()?;
        Some((value >> 1).cast_signed() ^ -(value & 1).cast_signed())
    }

    fn value(&mut self, kind: u8, depth: usize) -> Option<Value<'a>> {
        if depth > DEEPEST {
            return None;
        }
        Some(match kind {
            // The type of a boolean field contains its value.
            1 | 2 => Value::Other,
            3 => self.byte().map(|_| Value::Other)?,
            4..=6 => Value::Integer(self.integer()?),
            7 => self.take(8).map(|_| Value::Other)?,
            BINARY => {
                let length = usize::try_from(self.varint()?).ok()?;
                Value::Bytes(self.take(length)?)
            }
            LIST | 10 => {
                let header = self.byte()?;
                let kind = header & 0x0f;
                let length = match header >> 4 {
                    15 => usize::try_from(self.varint()?).ok()?,
                    length => length.into(),
                };
                // Each element, even a boolean, takes at least one byte.
                if length > self.bytes.len() {
                    return None;
                }
                let kind = if kind < 3 { 3 } else { kind };
                let elements = (0..length).map(|_| self.value(kind, depth + 1));
                Value::List(elements.collect::<Option<_>>()?)
            }
            STRUCT => {
                let (mut fields, mut id) = (Vec::new(), 0_i16);
                loop {
                    let header = self.byte()?;
                    if header == 0 {
                        break Value::Struct(fields);
                    }
                    id = match header >> 4 {
                        0 => i16::try_from(self.integer()?).ok()?,
                        step => id.checked_add(step.into())?,
                    };
                    fields.push((id, self.value(header & 0x0f, depth + 1)?));
                }
            }
            _ => return None,
        })
    }
}
