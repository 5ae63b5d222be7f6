//! A walk over a struct of Thrift's compact protocol, with the types of the fields of Parquet's metadata.
//!
//! Source: `parquet.thrift` of the Parquet format, version 2.12.

use Kind::{Byte, Double, Flag, Int, List, Struct, Text};

/// The type of a field; integers of any width are encoded alike.
pub(super) enum Kind {
    Flag,
    Byte,
    Int,
    Double,
    Text,
    List(&'static Kind),
    Struct(Fields),
}

/// The known fields of a struct, by number. The reader skips other fields by the type that the file states.
pub(super) type Fields = &'static [(i16, Kind)];

/// The struct `FileMetaData`, without the fields of encryption.
pub(super) const FILE_METADATA: Fields = &[
    (1, Int),
    (2, List(&Struct(SCHEMA_ELEMENT))),
    (3, Int),
    (4, List(&Struct(ROW_GROUP))),
    (5, List(&Struct(KEY_VALUE))),
    (6, Text),
    (7, List(&Struct(&[(1, Struct(&[]))]))),
];
const SCHEMA_ELEMENT: Fields = &[
    (1, Int),
    (2, Int),
    (3, Int),
    (4, Text),
    (5, Int),
    (6, Int),
    (7, Int),
    (8, Int),
    (9, Int),
    (10, Struct(LOGICAL_TYPE)),
];
const LOGICAL_TYPE: Fields = &[
    (1, Struct(&[])),
    (2, Struct(&[])),
    (3, Struct(&[])),
    (4, Struct(&[])),
    (5, Struct(&[(1, Int), (2, Int)])),
    (6, Struct(&[])),
    (7, Struct(TIME)),
    (8, Struct(TIME)),
    (10, Struct(&[(1, Byte), (2, Flag)])),
    (11, Struct(&[])),
    (12, Struct(&[])),
    (13, Struct(&[])),
    (14, Struct(&[])),
    (15, Struct(&[])),
    (16, Struct(&[(1, Byte)])),
    (17, Struct(&[(1, Text)])),
    (18, Struct(&[(1, Text), (2, Int)])),
];
const TIME: Fields = &[(1, Flag), (2, Struct(&[(1, Struct(&[])), (2, Struct(&[])), (3, Struct(&[]))]))];
const ROW_GROUP: Fields = &[
    (1, List(&Struct(COLUMN_CHUNK))),
    (2, Int),
    (3, Int),
    (4, List(&Struct(&[(1, Int), (2, Flag), (3, Flag)]))),
    (5, Int),
    (6, Int),
    (7, Int),
];
const COLUMN_CHUNK: Fields =
    &[(1, Text), (2, Int), (3, Struct(COLUMN_METADATA)), (4, Int), (5, Int), (6, Int), (7, Int)];
const COLUMN_METADATA: Fields = &[
    (1, Int),
    (2, List(&Int)),
    (3, List(&Text)),
    (4, Int),
    (5, Int),
    (6, Int),
    (7, Int),
    (8, List(&Struct(KEY_VALUE))),
    (9, Int),
    (10, Int),
    (11, Int),
    (12, Struct(STATISTICS)),
    (13, List(&Struct(&[(1, Int), (2, Int), (3, Int)]))),
    (14, Int),
    (15, Int),
    (16, Struct(&[(1, Int), (2, List(&Int)), (3, List(&Int))])),
    (17, Struct(&[(1, Struct(BOUNDING_BOX)), (2, List(&Int))])),
];
const KEY_VALUE: Fields = &[(1, Text), (2, Text)];
const STATISTICS: Fields = &[(1, Text), (2, Text), (3, Int), (4, Int), (5, Text), (6, Text), (7, Flag), (8, Flag)];
const BOUNDING_BOX: Fields =
    &[(1, Double), (2, Double), (3, Double), (4, Double), (5, Double), (6, Double), (7, Double), (8, Double)];
/// The struct `PageHeader`.
pub(super) const PAGE_HEADER: Fields = &[
    (1, Int),
    (2, Int),
    (3, Int),
    (4, Int),
    (5, Struct(&[(1, Int), (2, Int), (3, Int), (4, Int), (5, Struct(STATISTICS))])),
    (6, Struct(&[])),
    (7, Struct(&[(1, Int), (2, Int), (3, Flag)])),
    (8, Struct(&[(1, Int), (2, Int), (3, Int), (4, Int), (5, Int), (6, Int), (7, Flag), (8, Struct(STATISTICS))])),
];

/// Walks the struct that `bytes` begin with and passes every integer in it to `visit`, and the length of every
/// list, each with the numbers of the fields that lead there. Returns the length of the struct; `None` if it is damaged
/// or goes on beyond `bytes`.
pub(super) fn walk(bytes: &[u8], fields: Fields, visit: &mut dyn FnMut(&[i16], i64)) -> Option<usize> {
    let mut walker = Walker { bytes, at: 0, path: Vec::new(), visit };
    walker.fields(fields)?;
    Some(walker.at)
}

/// Greatest depth of nested structs; Parquet has six.
const MAX_NESTED_STRUCTS: usize = 16;

struct Walker<'a> {
    bytes: &'a [u8],
    at: usize,
    path: Vec<i16>,
    visit: &'a mut dyn FnMut(&[i16], i64),
}

impl Walker<'_> {
    fn byte(&mut self) -> Option<u8> {
        let byte = self.bytes.get(self.at).copied()?;
        self.at += 1;
        Some(byte)
    }

    fn skip(&mut self, length: u64) -> Option<()> {
        let at = self.at.checked_add(usize::try_from(length).ok()?)?;
        self.at = at;
        (at <= self.bytes.len()).then_some(())
    }

    /// A variable-length integer: groups of seven bits, the lowest first.
    fn varint(&mut self) -> Option<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(value);
            }
        }
        None
    }

    /// A signed integer, with the sign in the lowest bit.
    fn whole(&mut self) -> Option<i64> {
        let value = self.varint()?;
        Some((value >> 1) as i64 ^ -((value & 1) as i64))
    }

    fn fields(&mut self, known: Fields) -> Option<()> {
        if self.path.len() >= MAX_NESTED_STRUCTS {
            return None;
        }
        let mut field = 0_i16;
        loop {
            let head = self.byte()?;
            if head == 0 {
                return Some(());
            }
            field = match head >> 4 {
                0 => i16::try_from(self.whole()?).ok()?,
                step => field.checked_add(step.into())?,
            };
            self.path.push(field);
            let expected = known.iter().find(|(number, _)| *number == field).map(|(_, kind)| kind);
            // The type of a field is its value where that is true or false.
            match (head & 0xf, expected) {
                (1 | 2, None | Some(Flag)) => {}
                (kind, _) => self.value(kind, expected)?,
            }
            self.path.pop();
        }
    }

    /// Reads a value of type `kind`, which must be the expected one if the reader knows the field.
    fn value(&mut self, kind: u8, expected: Option<&'static Kind>) -> Option<()> {
        match (kind, expected) {
            (1 | 2, None) | (3, None | Some(Byte)) => self.skip(1),
            (4..=6, None | Some(Int)) => {
                // The reader keeps the lowest bits of numbers that are too large for their type, or for the one that it expects.
                let value = self.whole()?;
                let fits = kind == 6 || i32::try_from(value).is_ok();
                (self.visit)(&self.path, value);
                fits.then_some(())
            }
            (7, None | Some(Double)) => self.skip(8),
            (8, None | Some(Text)) => {
                let length = self.varint()?;
                self.skip(length)
            }
            (9 | 10, None | Some(List(_))) => {
                let head = self.byte()?;
                let count = match head >> 4 {
                    15 => self.varint()?,
                    count => count.into(),
                };
                // An element has at least one byte.
                let left = (self.bytes.len() - self.at) as u64;
                let count = (count <= left).then_some(count)?;
                (self.visit)(&self.path, count as i64);
                // Parquet has no lists of lists, and no maps.
                let kind = Some(head & 0xf).filter(|kind| !matches!(kind, 9 | 10))?;
                let element = match expected {
                    Some(List(element)) => Some(*element),
                    _ => None,
                };
                (0..count).try_for_each(|_| self.value(kind, element))
            }
            (12, None) => self.fields(&[]),
            (12, Some(Struct(known))) => self.fields(known),
            _ => None,
        }
    }
}
