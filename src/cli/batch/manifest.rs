//! A manifest: inputs and their options as lines of JSON, each laid over the command line.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, Command, FromArgMatches};
use coarsen::Error;
use coarsen::batch::Recipe;
use coarsen::formats::Weights;
use serde_json::{Map, Value};

use super::resolve::recipe;
use crate::cli::Exit;
use crate::cli::args::{self, Arguments, Each, Verb};
use crate::cli::failure::{message, refuse};
use crate::cli::values::Lock;

/// A line.
pub struct Entry {
    /// A file or a sample.
    pub input: String,
    pub recipe: Recipe,
}

/// Reads the manifest at `path`, over the command line `line`.
///
/// # Errors
/// A file that cannot be read; the first line that is no object with an input, or has an option that is none of each file or
/// has a wrong value.
pub fn read(path: &Path, line: &[OsString]) -> anyhow::Result<Vec<Entry>> {
    let text = fs::read_to_string(path).map_err(|source| Error::Read { path: path.to_path_buf(), source })?;
    let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    let mut reader = Reader { folder, line, command: args::command(), options: options() };
    let rows = text.lines().enumerate().filter(|(_, row)| !row.trim().is_empty());
    rows.map(|(i, row)| {
        reader
            .entry(row)
            .map_err(|error| refuse(Exit::Usage, format!("'{}' line {}: {}", path.display(), i + 1, message(&error))))
    })
    .collect()
}

/// The options that make a list of levels.
const LEVELS: [&str; 2] = ["ratios", "faces"];

struct Reader<'a> {
    folder: PathBuf,
    line: &'a [OsString],
    command: Command,
    /// Names of the options of each file.
    options: Vec<String>,
}

/// The long names of the options that go for each file.
fn options() -> Vec<String> {
    let each = Each::augment_args(Command::new("each"));
    each.get_arguments()
        .flat_map(|arg| arg.get_long_and_visible_aliases().unwrap_or_default())
        .map(Into::into)
        .collect()
}

impl Reader<'_> {
    fn entry(&mut self, row: &str) -> anyhow::Result<Entry> {
        let mut fields: Map<String, Value> = serde_json::from_str(row)
            .map_err(|error| refuse(Exit::Usage, format!("expected a JSON object: {error}")))?;
        let Some(Value::String(input)) = fields.remove("input") else {
            return Err(refuse(Exit::Usage, "it has no \"input\", the name of a file"));
        };
        let input = match input.starts_with("sample:") {
            true => input,
            false => self.folder.join(input).display().to_string(),
        };
        let mut each = self.each(&fields)?;
        if let (true, Some(Weights::File(path))) = (fields.contains_key("weight"), &mut each.how.weights.weight) {
            *path = self.folder.join(&*path);
        }
        if let (true, Some(Lock::File(path))) = (fields.contains_key("lock"), &mut each.how.shape.lock) {
            *path = self.folder.join(&*path);
        }
        Ok(Entry { input, recipe: recipe(&each)? })
    }

    /// The options of the command line with `fields` over them.
    fn each(&mut self, fields: &Map<String, Value>) -> anyhow::Result<Each> {
        let mut own = Vec::new();
        for (name, value) in fields {
            let name = name.replace('_', "-");
            if !self.options.contains(&name) {
                return Err(refuse(Exit::Usage, format!("'{name}' is no option of each file")));
            }
            own.extend(words(&name, value)?);
        }
        let has = |names: &[&str]| fields.keys().any(|name| names.contains(&name.as_str()));
        let says_levels = match (has(&["ratios", "ratio"]), has(&["faces"])) {
            (true, true) => return Err(refuse(Exit::Usage, "'ratios' and 'faces' contradict each other")),
            (by_ratio, by_faces) => by_ratio || by_faces,
        };
        let end = self.line.iter().position(|word| word == "--").unwrap_or(self.line.len());
        let words = self.line[..end].iter().chain(&own).chain(&self.line[end..]);
        let command = self.command.clone().mut_subcommand("batch", |batch| {
            let batch = batch.args_override_self(true);
            match says_levels {
                // What a line says of levels takes the place of all that the command line says.
                true => {
                    LEVELS.iter().fold(batch, |batch, name| batch.mut_arg(name, |arg| arg.overrides_with_all(LEVELS)))
                }
                false => batch,
            }
        });
        let wrong = |error: clap::Error| {
            // The first line says what is wrong, the others how the command line is used.
            let text = error.render().to_string();
            let first = text.lines().next().unwrap_or_default();
            refuse(Exit::Usage, first.trim_start_matches("error: "))
        };
        let matches = command.try_get_matches_from(words).map_err(wrong)?;
        match Arguments::from_arg_matches(&matches).map_err(wrong)?.verb {
            Verb::Batch(batch) => Ok(batch.each),
            _ => Err(refuse(Exit::Unexpected, "a manifest is read by another command")),
        }
    }
}

/// An option as words of a command line.
fn words(name: &str, value: &Value) -> anyhow::Result<Vec<OsString>> {
    let text = |value: &Value| match value {
        Value::String(text) => Some(text.clone()),
        Value::Number(number) => Some(number.to_string()),
        _ => None,
    };
    let joined = match value {
        Value::Bool(true) => return Ok(vec![format!("--{name}").into()]),
        Value::Array(values) => values.iter().map(text).collect::<Option<Vec<_>>>().map(|texts| texts.join(",")),
        value => text(value),
    };
    let wrong = || refuse(Exit::Usage, format!("'{name}' is {value}: give a text, a number, a list or true"));
    Ok(vec![format!("--{name}={}", joined.ok_or_else(wrong)?).into()])
}

#[cfg(test)]
mod tests {
    use coarsen::Budget;

    use super::*;

    fn line(text: &str) -> Vec<OsString> {
        text.split_whitespace().map(OsString::from).collect()
    }

    fn entries(command: &str, manifest: &str) -> Result<Vec<Entry>, String> {
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("jobs.jsonl");
        fs::write(&path, manifest).expect("a manifest");
        read(&path, &line(command)).map_err(|error| error.to_string())
    }

    #[test]
    fn options_of_a_line_come_before_those_of_the_command_line() {
        let command = "coarsen batch --manifest m -d out --ratios 50%,10% --metric plane --max-flip 45";
        let manifest = "{\"input\": \"a.ply\"}\n\n\
            {\"input\": \"sample:part@5k\", \"faces\": [500, \"1k\"], \"lock_border\": true, \"max-flip\": 90}\n";
        let entries = entries(command, manifest).expect("entries");
        let [a, b] = &entries[..] else { panic!("{} entries", entries.len()) };
        assert!(a.input.ends_with("a.ply") && a.input.len() > 5 && b.input == "sample:part@5k");
        let options = |entry: &Entry| match &entry.recipe.method {
            coarsen::Method::Contract(options) => options.clone(),
            other => panic!("{other:?}"),
        };
        use coarsen::contract::Metric;
        assert_eq!(a.recipe.budgets, [Budget::keep(0.5), Budget::keep(0.1)]);
        assert_eq!(b.recipe.budgets, [Budget::faces(1000), Budget::faces(500)]);
        assert_eq!((options(a).metric, options(b).metric), (Metric::Plane, Metric::Plane));
        assert_eq!((options(a).lock_border, options(b).lock_border), (false, true));
        assert_eq!(options(b).max_flip_rad, std::f32::consts::FRAC_PI_2);
        assert_eq!(options(a).max_flip_rad, std::f32::consts::FRAC_PI_4);
    }

    #[test]
    fn a_wrong_line_is_told_with_its_number() {
        let command = "coarsen batch --manifest m -d out --ratios 50%";
        for (row, part) in [
            ("[1]", "expected a JSON object"),
            ("{}", "it has no \"input\""),
            ("{\"input\": \"a.ply\", \"threads\": 2}", "'threads' is no option of each file"),
            ("{\"input\": \"a.ply\", \"metric\": \"x\"}", "invalid value 'x'"),
            ("{\"input\": \"a.ply\", \"ratios\": null}", "'ratios' is null"),
            ("{\"input\": \"a.ply\", \"ratios\": 0.5, \"faces\": 3}", "contradict"),
            ("{\"input\": \"a.ply\", \"grid\": 3}", "'grid' is no option"),
            ("{\"input\": \"a.ply\", \"ratios\": [0.5, \"50%\"]}", "given twice"),
        ] {
            let manifest = format!("{{\"input\": \"a.ply\"}}\n{row}\n");
            let error = entries(command, &manifest).err().expect(row);
            assert!(error.contains("line 2: ") && error.contains(part), "{row}: {error}");
        }
    }

    #[test]
    fn levels_of_a_line_come_before_those_of_the_command_line_in_every_form() {
        let manifest = "{\"input\": \"a.ply\"}\n{\"input\": \"b.ply\", \"faces\": [40, 30]}\n\
            {\"input\": \"c.ply\", \"ratio\": 0.5}\n";
        for form in
            ["--ratios 5%", "--ratios=5%", "-r 5%", "-r5%", "-wr5%", "-qwr 5%", "--ratio=5%", "--faces 3", "-qf3"]
        {
            let entries = entries(&format!("coarsen batch --manifest m -d out {form}"), manifest).expect(form);
            let budgets: Vec<&[Budget]> = entries.iter().map(|entry| &entry.recipe.budgets[..]).collect();
            let own = if form.contains('f') { Budget::faces(3) } else { Budget::keep(0.05) };
            assert_eq!(budgets[0], [own], "{form}");
            assert_eq!(budgets[1..], [&[Budget::faces(40), Budget::faces(30)][..], &[Budget::keep(0.5)]], "{form}");
        }
        let twice = entries("coarsen batch --manifest m -d out -r 50% -r 10%", manifest).expect("two levels");
        assert_eq!(twice[0].recipe.budgets, [Budget::keep(0.5), Budget::keep(0.1)]);
    }

    #[test]
    fn files_are_named_from_the_manifest_s_folder_and_are_no_globs() {
        let row = "{\"input\": \"a[1].ply\", \"weight\": \"w.txt\"}";
        let entries = entries("coarsen batch --manifest m -d out -r 50%", row).expect("an entry");
        let folder = Path::new(&entries[0].input).parent().expect("a folder").to_path_buf();
        assert!(entries[0].input.ends_with("a[1].ply") && folder.is_absolute());
        assert_eq!(entries[0].recipe.weights, Some(Weights::File(folder.join("w.txt"))));
    }
}
