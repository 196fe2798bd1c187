//! The file of records: a line of JSON for every level of every file, appended and synced as it is done.
//!
//! A record is written after its output stands under its name, so that nothing is told done that is not. Each shard has its
//! own file, and a run that goes on reads those of all. A line that a killed run left torn is cut off.

use std::collections::{BTreeMap, HashMap};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use super::beside::Beside;
use super::failure::Reason;
use super::plan::Shard;
use crate::error::{Error, Result};
use crate::metrics::{self, Spread};
use crate::simplify::{Blocked, StopReason};

/// A record: one level of one file. Fields are only ever added under this `schema`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Record {
    /// 1.
    pub schema: u32,
    /// `done` or `failed`.
    pub status: Status,
    /// The name of the input.
    pub input: String,
    /// The name of the output, below the folder of the record.
    pub output: String,
    /// The level, from 1, of so many.
    pub level: usize,
    /// Levels of the file.
    pub levels: usize,
    /// A sum of the input's bytes, of the output's, and of the options; null where a failure came before.
    pub input_hash: Option<Hash>,
    /// Of the output.
    pub output_hash: Option<Hash>,
    /// Of the files beside the input that the output is made of, by their names from its folder: buffers of a glTF, libraries and
    /// pictures of an OBJ that becomes one. None of a file that was looked for and is not there.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub beside: BTreeMap<String, Option<Hash>>,
    /// Of the options.
    pub options: Hash,
    /// The version of the program.
    pub version: String,
    /// What became of it; none of a failure.
    #[serde(flatten)]
    pub made: Option<Made>,
    /// Why there is none, and what exactly; none where it is done.
    #[serde(flatten)]
    pub failure: Option<super::failure::Failure>,
}

/// What a level became; the fields are those of a record of a single run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Made {
    /// The device in words.
    pub device: String,
    /// Of the input.
    pub faces_in: usize,
    /// Of the output.
    pub faces_out: usize,
    /// Of the input.
    pub vertices_in: usize,
    /// Of the output.
    pub vertices_out: usize,
    /// The face count asked for; null with only an error limit.
    pub target: Option<usize>,
    /// Whether it was reached, or with only an error limit that.
    pub reached: bool,
    /// Why the run ended.
    pub stop_reason: StopReason,
    /// What blocked further reduction.
    pub blocked: Blocked,
    /// How far off the result is.
    pub error: Deviation,
    /// Wall-clock seconds.
    pub seconds: Seconds,
    /// What the caller should know.
    pub warnings: Vec<String>,
}

/// How far a result is from the input.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Deviation {
    /// In model units.
    pub estimate: f64,
    /// As a fraction of the bounding box's diagonal.
    pub estimate_relative: f64,
    /// Where it was measured.
    pub measured: Option<Measured>,
}

impl Deviation {
    /// What is estimated on a mesh of this diagonal, and measured if it was.
    pub fn new(estimate: f64, diagonal: f64, measured: Option<&metrics::Deviation>) -> Self {
        Self {
            estimate,
            estimate_relative: if diagonal > 0.0 { estimate / diagonal } else { 0.0 },
            measured: measured.map(Measured::from),
        }
    }
}

/// The symmetric deviation of result and input.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Measured {
    /// In model units: the Hausdorff distance.
    pub max: f64,
    /// The greater mean of both sides.
    pub mean: f64,
    /// The greater root mean square.
    pub rms: f64,
    /// As fractions of the bounding box's diagonal.
    pub max_relative: f64,
    /// The mean.
    pub mean_relative: f64,
    /// The root mean square.
    pub rms_relative: f64,
}

impl From<&metrics::Deviation> for Measured {
    fn from(deviation: &metrics::Deviation) -> Self {
        let Spread { max, mean, rms } = deviation.symmetric();
        let relative = |length: f64| if deviation.diagonal > 0.0 { length / deviation.diagonal } else { 0.0 };
        let [max_relative, mean_relative, rms_relative] = [max, mean, rms].map(relative);
        Self { max, mean, rms, max_relative, mean_relative, rms_relative }
    }
}

/// Wall-clock seconds of a file; reading and solving are of all its levels together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Seconds {
    /// Reading.
    pub read: f64,
    /// Solving.
    pub solve: f64,
    /// Writing this level.
    pub write: f64,
    /// Measuring it.
    pub measure: f64,
}

/// Whether a level is done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The output is there.
    Done,
    /// It is not.
    Failed,
}

/// A sum of bytes as 16 hexadecimal digits, which no reader of JSON rounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Hash(pub u64);

impl From<Hash> for String {
    fn from(hash: Hash) -> Self {
        format!("{:016x}", hash.0)
    }
}

impl TryFrom<String> for Hash {
    type Error = std::num::ParseIntError;

    fn try_from(text: String) -> std::result::Result<Self, Self::Error> {
        u64::from_str_radix(&text, 16).map(Self)
    }
}

/// What must be equal for a level to be done: where it came from, and what it is.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub(super) struct Stamp {
    /// Which of the levels, counted from 1: its place in the options.
    pub level: usize,
    pub input_hash: Hash,
    pub output_hash: Hash,
    pub options: Hash,
    pub version: String,
}

/// A line as far as a run that goes on needs it.
#[derive(Deserialize)]
struct Line {
    status: Status,
    output: String,
    #[serde(flatten)]
    stamp: Stamp,
    /// Records of inputs that are one file say nothing.
    #[serde(default)]
    beside: Beside,
}

/// What earlier runs say is done, by output. Two may say so with different options.
#[derive(Debug, Default)]
pub(super) struct Known(HashMap<String, Vec<(Stamp, Beside)>>);

impl Known {
    /// Whether a record with this stamp is there, of files beside the input that `agree`.
    pub fn has(&self, output: &str, stamp: &Stamp, mut agree: impl FnMut(&Beside) -> bool) -> bool {
        let known = self.0.get(output).into_iter().flatten();
        known.filter(|(known, _)| known == stamp).any(|(_, beside)| agree(beside))
    }

    /// Whether there is any record of `output`, so that its hashes are worth finding.
    pub fn mentions(&self, output: &str) -> bool {
        self.0.contains_key(output)
    }

    /// The records of all shards in `folder`.
    ///
    /// # Errors
    /// [`Error::Read`] for a file of records that cannot be read. Lines that are none are left out.
    pub fn read(folder: &Path) -> Result<Self> {
        let mut known = Self::default();
        for path in ledgers(folder)? {
            let bytes = fs::read(&path).map_err(|source| Error::Read { path, source })?;
            for line in bytes.split(|&byte| byte == b'\n') {
                // A failure has no hash of an output, and is no stamp.
                if let Ok(Line { status: Status::Done, output, stamp, beside }) = serde_json::from_slice(line) {
                    known.0.entry(output).or_default().push((stamp, beside));
                }
            }
        }
        Ok(known)
    }
}

/// The files of records in `folder`, of any shards.
pub(super) fn ledgers(folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = |source| Error::Read { path: folder.to_path_buf(), source };
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(failed)?,
    };
    let mut paths = Vec::new();
    for entry in entries {
        let entry = entry.map_err(failed)?;
        if Shard::of_ledger(&entry.file_name().to_string_lossy()).is_some() {
            paths.push(entry.path());
        }
    }
    paths.sort();
    Ok(paths)
}

/// A file of records, open at its end.
#[derive(Debug)]
pub(super) struct Ledger {
    path: PathBuf,
    file: File,
    /// Where the last whole line ends.
    end: Mutex<u64>,
}

impl Ledger {
    /// Opens the file at `path`, emptied unless the run goes on; then a torn last line is cut off.
    ///
    /// # Errors
    /// [`Error::Write`] when the system refuses.
    pub fn open(path: &Path, goes_on: bool) -> Result<Self> {
        let open = || -> io::Result<(File, u64)> {
            let mut file = OpenOptions::new().read(true).append(true).create(true).open(path)?;
            let mut bytes = Vec::new();
            if goes_on {
                file.read_to_end(&mut bytes)?;
            }
            let end = bytes.iter().rposition(|&byte| byte == b'\n').map_or(0, |newline| newline as u64 + 1);
            file.set_len(end)?;
            Ok((file, end))
        };
        let (file, end) = open().map_err(|source| Error::Write { path: path.to_path_buf(), source })?;
        Ok(Self { path: path.to_path_buf(), file, end: Mutex::new(end) })
    }

    /// Appends `records`, and returns when they are on the disk. Lines that could not be finished are cut off.
    ///
    /// # Errors
    /// [`Error::Write`] when the system refuses.
    pub fn append(&self, records: &[Record]) -> Result<()> {
        let failed = |source| Error::Write { path: self.path.clone(), source };
        let mut lines = Vec::new();
        for record in records {
            serde_json::to_writer(&mut lines, record).map_err(|error| failed(error.into()))?;
            lines.push(b'\n');
        }
        self.write(&lines).map_err(failed)?;
        // Not under the lock: the disk takes many lines at once.
        self.file.sync_data().map_err(failed)
    }

    fn write(&self, lines: &[u8]) -> io::Result<()> {
        let mut end = self.end.lock().unwrap_or_else(PoisonError::into_inner);
        (&self.file).write_all(lines).inspect_err(|_| {
            // Should this fail as well, a reader leaves the torn line out.
            let _ = self.file.set_len(*end);
        })?;
        *end += lines.len() as u64;
        Ok(())
    }
}

impl Record {
    /// Why it failed, if it did.
    pub fn reason(&self) -> Option<Reason> {
        self.failure.as_ref().map(|failure| failure.reason)
    }
}

#[cfg(test)]
mod tests {
    use super::super::failure::Failure;
    use super::*;

    fn record(output: &str, hash: u64) -> Record {
        Record {
            schema: 1,
            status: Status::Done,
            input: "x.ply".into(),
            output: output.into(),
            level: 1,
            levels: 1,
            input_hash: Some(Hash(1)),
            output_hash: Some(Hash(hash)),
            beside: BTreeMap::new(),
            options: Hash(u64::MAX),
            version: "1".into(),
            made: None,
            failure: None,
        }
    }

    fn stamp(hash: u64) -> Stamp {
        let version = "1".into();
        Stamp { level: 1, input_hash: Hash(1), output_hash: Hash(hash), options: Hash(u64::MAX), version }
    }

    #[test]
    fn records_of_all_shards_are_known_and_failures_are_not() {
        let dir = tempfile::tempdir().expect("a folder");
        let [one, two] = ["coarsen.jsonl", "coarsen-2-of-3.jsonl"].map(|name| dir.path().join(name));
        Ledger::open(&one, false).and_then(|ledger| ledger.append(&[record("a", 2)])).expect("a record");
        let failure = Failure { reason: Reason::Malformed, message: "?".into() };
        let failed = Record { status: Status::Failed, output_hash: None, failure: Some(failure), ..record("c", 4) };
        Ledger::open(&two, false).and_then(|ledger| ledger.append(&[record("b", 3), failed])).expect("records");
        fs::write(dir.path().join("coarsen-x.jsonl"), "no records").expect("a file");
        let known = Known::read(dir.path()).expect("records");
        let has = |output: &str, stamp: &Stamp| known.has(output, stamp, Beside::is_empty);
        assert!(has("a", &stamp(2)) && has("b", &stamp(3)));
        assert!(!has("a", &stamp(3)) && !known.mentions("c"));
        assert!(!has("a", &Stamp { options: Hash(0), ..stamp(2) }));
        assert!(!has("a", &Stamp { level: 2, ..stamp(2) }));
        assert!(!has("a", &Stamp { version: "2".into(), ..stamp(2) }));
        assert_eq!(ledgers(dir.path()).expect("files"), [two, one]);
        assert!(Known::read(&dir.path().join("none")).is_ok_and(|known| known.0.is_empty()));
    }

    #[test]
    fn a_torn_line_is_left_out_and_cut_off_wherever_it_was_torn() {
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("coarsen.jsonl");
        Ledger::open(&path, false)
            .and_then(|ledger| ledger.append(&[record("a", 2), record("b", 3)]))
            .expect("records");
        let whole = fs::read(&path).expect("records");
        let first = whole.iter().position(|&byte| byte == b'\n').expect("a line") + 1;
        for cut in first..whole.len() {
            fs::write(&path, &whole[..cut]).expect("a torn file");
            let known = Known::read(dir.path()).expect("records");
            // The newline alone is no loss to a reader.
            let has_first = known.has("a", &stamp(2), Beside::is_empty);
            assert!(has_first && known.mentions("b") == (cut == whole.len() - 1), "{cut}");
            let ledger = Ledger::open(&path, true).expect("a ledger");
            assert_eq!(fs::read(&path).expect("records"), whole[..first], "{cut}");
            ledger.append(&[record("b", 3)]).expect("a record");
            assert_eq!(fs::read(&path).expect("records"), whole, "{cut}");
        }
        Ledger::open(&path, false).expect("a ledger");
        assert_eq!(fs::read(&path).expect("records"), b"");
    }

    #[test]
    fn a_line_is_as_documented() {
        let line = serde_json::to_value(record("a.ply", 255)).expect("JSON");
        let expected = serde_json::json!({
            "schema": 1, "status": "done", "input": "x.ply", "output": "a.ply", "level": 1, "levels": 1,
            "input_hash": "0000000000000001", "output_hash": "00000000000000ff", "options": "ffffffffffffffff",
            "version": "1",
        });
        assert_eq!(line, expected);
        let beside = BTreeMap::from([("x.bin".to_string(), Some(Hash(16))), ("x.mtl".to_string(), None)]);
        let line = serde_json::to_value(Record { beside, ..record("a.ply", 255) }).expect("JSON");
        assert_eq!(line["beside"], serde_json::json!({ "x.bin": "0000000000000010", "x.mtl": null }));
    }
}
