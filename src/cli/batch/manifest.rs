//! A manifest: inputs and their options as lines of JSON, each laid over the command line.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

use clap::{Arg, ArgAction, Args, Command, FromArgMatches, Id, value_parser};
use coarsen::Error;
use coarsen::batch::Recipe;
use coarsen::formats::Weights;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::Value;

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
/// A file that cannot be read or has no line; the first line that is no object with an input, or has a key twice, an option that
/// is none of each file or a wrong value.
pub fn read(path: &Path, line: &[OsString]) -> anyhow::Result<Vec<Entry>> {
    let text = fs::read_to_string(path).map_err(|source| Error::Read { path: path.to_path_buf(), source })?;
    let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    let mut reader = Reader { folder, line, command: args::command(), options: options() };
    // Some editors mark UTF-8.
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let rows = text.lines().enumerate().filter(|(_, row)| !row.trim().is_empty());
    let entry = |(i, row): (usize, &str)| {
        let named = |error| refuse(Exit::Usage, format!("'{}' line {}: {}", path.display(), i + 1, message(&error)));
        reader.entry(row).map_err(named)
    };
    let entries: Vec<Entry> = rows.map(entry).collect::<anyhow::Result<_>>()?;
    match entries.is_empty() {
        true => Err(refuse(Exit::Usage, format!("'{}' names no file: give a line for each", path.display()))),
        false => Ok(entries),
    }
}

/// The options that make a list of levels.
const LEVELS: [&str; 2] = ["ratios", "faces"];

struct Reader<'a> {
    folder: PathBuf,
    line: &'a [OsString],
    command: Command,
    /// The options of each file.
    options: Vec<Known>,
}

/// An option that goes for each file.
struct Known {
    id: Id,
    /// Its long name, and others that it goes by.
    long: String,
    aliases: Vec<String>,
    /// Whether it is there or not, and has no value.
    is_switch: bool,
}

fn options() -> Vec<Known> {
    let each = Each::augment_args(Command::new("each"));
    let known = |arg: &Arg| {
        let aliases = arg.get_visible_aliases().unwrap_or_default().into_iter().map(Into::into).collect();
        let is_switch = !arg.get_action().takes_values();
        Some(Known { id: arg.get_id().clone(), long: arg.get_long()?.into(), aliases, is_switch })
    };
    each.get_arguments().filter_map(known).collect()
}

/// The members of an object, in order, even if two have one name.
struct Members(Vec<(String, Value)>);

impl<'de> Deserialize<'de> for Members {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct InOrder;
        impl<'de> Visitor<'de> for InOrder {
            type Value = Members;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Members, A::Error> {
                let mut members = Vec::new();
                while let Some(member) = map.next_entry()? {
                    members.push(member);
                }
                Ok(Members(members))
            }
        }
        deserializer.deserialize_map(InOrder)
    }
}

impl Reader<'_> {
    fn entry(&mut self, row: &str) -> anyhow::Result<Entry> {
        let Members(members) = serde_json::from_str(row)
            .map_err(|error| refuse(Exit::Usage, format!("expected a JSON object: {error}")))?;
        let mut fields: BTreeMap<String, Value> = BTreeMap::new();
        for (name, value) in members {
            let name = self.own_name(&name);
            if fields.contains_key(&name) {
                return Err(refuse(Exit::Usage, format!("'{name}' is given twice")));
            }
            fields.insert(name, value);
        }
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

    /// The long name of the option that a key stands for; the key of none.
    fn own_name(&self, key: &str) -> String {
        let name = key.replace('_', "-");
        let known = self.options.iter().find(|option| option.aliases.contains(&name));
        known.map_or(name, |option| option.long.clone())
    }

    /// The options of the command line with `fields` over them.
    fn each(&mut self, fields: &BTreeMap<String, Value>) -> anyhow::Result<Each> {
        let (mut own, mut off) = (Vec::new(), Vec::new());
        for (name, value) in fields {
            let Some(option) = self.options.iter().find(|option| option.long == *name) else {
                return Err(refuse(Exit::Usage, format!("'{name}' is no option of each file")));
            };
            own.push(word(name, value, option.is_switch)?);
            off.extend((*value == Value::Bool(false)).then_some(option.id.as_str()));
        }
        let says_levels = match (fields.contains_key("ratios"), fields.contains_key("faces")) {
            (true, true) => return Err(refuse(Exit::Usage, "'ratios' and 'faces' contradict each other")),
            (by_ratio, by_faces) => by_ratio || by_faces,
        };
        let end = self.line.iter().position(|word| word == "--").unwrap_or(self.line.len());
        let words = self.line[..end].iter().chain(&own).chain(&self.line[end..]);
        let command = self.command.clone().mut_subcommand("batch", |batch| {
            let batch = off.iter().fold(batch.args_override_self(true), |batch, id| batch.mut_arg(id, takes_false));
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

/// A switch that `--name=false` takes off again; without a value it is on, as before.
fn takes_false(switch: Arg) -> Arg {
    let switch = switch.action(ArgAction::Set).value_parser(value_parser!(bool)).num_args(0..=1).require_equals(true);
    switch.default_missing_value("true").default_value("false")
}

/// An option as a word of a command line.
fn word(name: &str, value: &Value, is_switch: bool) -> anyhow::Result<OsString> {
    let text = |value: &Value| match value {
        Value::String(text) => Some(text.clone()),
        Value::Number(number) => Some(number.to_string()),
        _ => None,
    };
    let given = match value {
        Value::Bool(true) if is_switch => return Ok(format!("--{name}").into()),
        Value::Bool(false) if is_switch => Some("false".into()),
        _ if is_switch => None,
        Value::Array(values) => values.iter().map(text).collect::<Option<Vec<_>>>().map(|texts| texts.join(",")),
        value => text(value),
    };
    let wanted = if is_switch { "true or false" } else { "a text, a number or a list" };
    let wrong = || refuse(Exit::Usage, format!("'{name}' is {value}: give {wanted}"));
    Ok(format!("--{name}={}", given.ok_or_else(wrong)?).into())
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
            ("{\"input\": \"a.ply\", \"input\": \"b.ply\"}", "'input' is given twice"),
            ("{\"input\": \"a.ply\", \"lock_border\": true, \"lock-border\": true}", "'lock-border' is given twice"),
            ("{\"input\": \"a.ply\", \"ratio\": 0.1, \"ratios\": 0.2}", "'ratios' is given twice"),
            ("{\"input\": \"a.ply\", \"lock-border\": 1}", "'lock-border' is 1: give true or false"),
            ("{\"input\": \"a.ply\", \"metric\": false}", "'metric' is false: give a text"),
        ] {
            let manifest = format!("{{\"input\": \"a.ply\"}}\n{row}\n");
            let error = entries(command, &manifest).err().expect(row);
            assert!(error.contains("line 2: ") && error.contains(part), "{row}: {error}");
        }
    }

    #[test]
    fn a_mark_is_passed_over_and_nothing_at_all_is_refused() {
        let command = "coarsen batch --manifest m -d out --ratios 50%";
        assert_eq!(entries(command, "\u{feff}{\"input\": \"a.ply\"}\r\n").expect("an entry").len(), 1);
        for nothing in ["", "\n \r\n", "\u{feff}"] {
            let error = entries(command, nothing).err().expect("no entries");
            assert!(error.contains("jobs.jsonl' names no file"), "{error}");
        }
    }

    #[test]
    fn switches_are_put_on_and_taken_off() {
        let manifest = "{\"input\": \"a.ply\"}\n{\"input\": \"a.ply\", \"lock-border\": false}\n\
            {\"input\": \"a.ply\", \"lock-border\": true}\n";
        for (switch, expected) in [("--lock-border", [true, false, true]), ("", [false, false, true])] {
            let entries =
                entries(&format!("coarsen batch {switch} --manifest m -d out -r 50%"), manifest).expect("entries");
            let is_on = |entry: &Entry| match &entry.recipe.method {
                coarsen::Method::Contract(options) => options.lock_border,
                other => panic!("{other:?}"),
            };
            assert_eq!(entries.iter().map(is_on).collect::<Vec<_>>(), expected, "{switch}");
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
