//! Who may import whom: the table of docs/architecture.md, held against every path in `src`, tests in modules
//! included.

mod scan;

use std::fs;
use std::path::{Path, PathBuf};

use scan::{Import, imports};

/// A part of the crate: its module, and the modules or items that it may name beside its own. A room's errors and
/// types count as the room.
struct Room {
    module: &'static str,
    may_import: &'static [&'static str],
}

const ALL: &[&str] = &["bitstream", "decoder", "encoder", "mesh", "metrics", "render", "vectorize", "video"];

/// A module belongs to the first room that fits.
const ROOMS: &[Room] = &[
    Room { module: "video", may_import: &[] },
    Room { module: "mesh", may_import: &["video::Label"] },
    Room { module: "bitstream", may_import: &["mesh", "video"] },
    Room { module: "render", may_import: &["mesh", "video"] },
    Room { module: "vectorize::segment", may_import: &["mesh", "video"] },
    Room { module: "vectorize::parallel", may_import: &[] },
    Room { module: "vectorize::lattice", may_import: &["mesh", "video", "vectorize::parallel"] },
    Room { module: "vectorize::cleave", may_import: &["mesh", "video", "vectorize::lattice", "vectorize::parallel"] },
    Room { module: "vectorize::simplify", may_import: &["mesh", "video", "vectorize::parallel"] },
    Room { module: "vectorize::fit", may_import: &["mesh", "video", "render"] },
    Room { module: "encoder", may_import: ALL },
    Room { module: "decoder", may_import: &["bitstream", "render", "mesh", "video"] },
    Room { module: "metrics", may_import: &["video"] },
];

/// Modules that only list others.
const LISTS: &[&str] = &["", "vectorize"];

/// The core runs where there are none of these: the world outside is its callers' business.
const FORBIDDEN: &[&str] =
    &["std::env", "std::fs", "std::io", "std::net", "std::os", "std::process", "std::thread", "std::time"];

/// Whether `path` is `module` or lies in it.
fn lies_in(path: &[String], module: &str) -> bool {
    let module: Vec<&str> = module.split("::").collect();
    path.len() >= module.len() && path.iter().zip(&module).all(|(a, b)| a == b)
}

/// What of `import` the file of `module` may not name, or `None`.
fn violation(module: &[String], import: &Import) -> Option<String> {
    let path = import.path.join("::");
    if import.path.first().is_some_and(|first| first == "std") {
        let forbidden = FORBIDDEN.iter().any(|forbidden| lies_in(&import.path, forbidden));
        return forbidden.then(|| format!("{path}: the core knows no files, clocks, threads or processes"));
    }
    if LISTS.contains(&module.join("::").as_str()) {
        return None;
    }
    let Some(room) = ROOMS.iter().find(|room| lies_in(module, room.module)) else {
        return Some(format!("{}: a module of no room", module.join("::")));
    };
    let allowed = lies_in(&import.path, room.module) || room.may_import.iter().any(|item| lies_in(&import.path, item));
    (!allowed).then(|| format!("{path}: `{}` may import {:?}", room.module, room.may_import))
}

/// Violations of one file as `file:line: what`.
fn violations(file: &str, source: &str) -> Vec<String> {
    let module = module_of(file);
    let found = imports(source, &module);
    let found = found.iter().filter_map(|import| Some((import.line, violation(&module, import)?)));
    found.map(|(line, what)| format!("src/{file}:{line}: {what}")).collect()
}

/// The module of a file in `src`.
fn module_of(file: &str) -> Vec<String> {
    let stem = file.strip_suffix(".rs").unwrap_or(file);
    let mut module: Vec<String> = stem.split('/').map(str::to_owned).collect();
    module.pop_if(|last| last == "mod" || last == "lib");
    module
}

fn source_files(folder: &Path, files: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).expect("a folder of sources");
    for entry in entries {
        let path = entry.expect("an entry of the folder").path();
        if path.is_dir() {
            source_files(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

#[test]
fn rooms_import_what_the_architecture_says() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    source_files(&root, &mut files);
    files.sort();
    let (mut found, mut scanned) = (Vec::new(), 0);
    for path in &files {
        let source = fs::read_to_string(path).expect("source text");
        let file = path.strip_prefix(&root).expect("a file below src").to_str().expect("a name in ASCII");
        scanned += imports(&source, &module_of(file)).len();
        found.extend(violations(&file.replace('\\', "/"), &source));
    }
    assert!(scanned > files.len(), "{scanned} paths in {} files: the scan sees too little", files.len());
    assert!(found.is_empty(), "imports against docs/architecture.md:\n{}", found.join("\n"));
}

#[test]
fn rooms_of_the_table_are_those_of_the_architecture() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/architecture.md");
    let text = fs::read_to_string(path).expect("docs/architecture.md");
    let rows = text.lines().skip_while(|line| !line.starts_with("| room |")).skip(2);
    let first_cells: Vec<&str> =
        rows.take_while(|line| line.starts_with('|')).filter_map(|line| line.split('|').nth(1)).collect();
    let documented: Vec<&str> = first_cells.iter().flat_map(|cell| cell.split('`').skip(1).step_by(2)).collect();
    for room in ROOMS {
        let name = room.module.rsplit("::").next().expect("a last segment");
        let listed = documented.iter().any(|entry| *entry == room.module.replace("::", "/") || *entry == name);
        assert!(listed, "{} is missing in docs/architecture.md, which has {documented:?}", room.module);
    }
    assert_eq!(documented.len(), ROOMS.len(), "rooms of docs/architecture.md: {documented:?}");
}

fn lines(file: &str, source: &str) -> Vec<usize> {
    let line = |violation: String| violation.split(':').nth(1).and_then(|line| line.parse().ok());
    violations(file, source).into_iter().map(|violation| line(violation).expect("a line")).collect()
}

#[test]
fn forbidden_imports_are_found_wherever_they_hide() {
    for (file, source, expected) in [
        ("mesh/ids.rs", "use crate::video::Label;\nuse crate::video::Frame;\n", vec![2]),
        ("mesh/ids.rs", "use crate::video::{Frame, Label};", vec![1]),
        (
            "render/draw.rs",
            "use crate::{\n    mesh::Domain,\n    bitstream::{Limits, ParseError as E},\n};",
            vec![3, 3],
        ),
        ("render/draw.rs", "fn f(limits: &crate::bitstream::Limits) {}", vec![1]),
        ("render/mod.rs", "use super::bitstream::Limits;", vec![1]),
        ("render/draw.rs", "mod tests {\n    use super::super::super::bitstream::Limits;\n}", vec![2]),
        ("render/draw.rs", "mod a { fn f() {} }\nuse super::super::decoder::Decoder;", vec![2]),
        ("vectorize/fit/patch.rs", "use crate::render::Masks;\nuse super::super::simplify::Goal;", vec![2]),
        ("vectorize/simplify/queue.rs", "use crate::vectorize::{cleave::cleave, simplify::Goal};", vec![1]),
        ("video/frame.rs", "/* } */ use crate::*;", vec![1]),
        ("metrics.rs", "const S: &str = \"\\\"\"; use crate::Frame;", vec![1]),
        ("decoder.rs", "let c = '\"'; let x = crate::encoder::Encoder::<'_>::new();", vec![1]),
        ("decoder.rs", "use std::{fmt, time::Instant};", vec![1]),
        ("util.rs", "use crate::video::Frame;", vec![1]),
    ] {
        assert_eq!(lines(file, source), expected, "{file}: {source}");
    }
}

#[test]
fn allowed_imports_and_what_only_looks_like_one_pass() {
    for (file, source) in [
        ("render/draw.rs", "use super::pack::bands;\nuse crate::mesh::{Domain, TetMesh as Mesh};"),
        (
            "render/draw.rs",
            "// use crate::bitstream::Limits;\n/* crate::decoder::Decoder /* nested */ crate::encoder::E */",
        ),
        (
            "render/draw.rs",
            "const S: &str = \"use crate::bitstream::Limits\"; const R: &str = r#\"\"crate::encoder::E\"#;",
        ),
        ("render/draw.rs", "mod tests { mod deep { use super::super::Scene; } }\nuse super::scene::Corner;"),
        ("vectorize/cleave/mod.rs", "use super::lattice::Lattice;"),
        ("encoder/slab.rs", "use crate::vectorize::fit::fit; use crate::bitstream::Packet; use super::EncodeError;"),
        ("bitstream/index.rs", "let x = a::crate_like::super_like; let tag: &'static str = 'x'.into();"),
        ("lib.rs", "pub use crate::video::Frame;"),
    ] {
        assert!(lines(file, source).is_empty(), "{file}: {:?}", violations(file, source));
    }
}
