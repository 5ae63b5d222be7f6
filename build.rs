//! Computes the numerics revision: a hash of the sources that the bytes of a part follow from.
//!
//! It is part of the identity of a dataset, with the version: commits of one version may differ in their numbers. Nobody has to remember
//! to raise it. Comments and unit tests do not enter it.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs, io};

use sha2::{Digest, Sha256};

/// Files and folders of sources: grid, solvers, tables, and what writes them.
const SOURCES: [&str; 17] = [
    "src/dataset/batch.rs",
    "src/dataset/cell.rs",
    "src/dataset/checksum.rs",
    "src/dataset/chunk.rs",
    "src/dataset/dictionary.rs",
    "src/dataset/footer.rs",
    "src/dataset/layout.rs",
    "src/dataset/numbers.rs",
    "src/dataset/part.rs",
    "src/dataset/rle.rs",
    "src/dataset/statistics.rs",
    "src/grid",
    "src/model",
    "src/numerics",
    "src/protocol",
    "src/stability",
    "src/table",
];

/// Crates that compute numbers or write bytes of a part.
const CRATES: [&str; 7] = ["libm", "nalgebra", "parquet", "rand_pcg", "sobol_burley", "zstd-safe", "zstd-sys"];

/// Hexadecimal digits of a revision: two of a million have the same one with a probability of 2e-3 (birthday bound of 48 bits).
const DIGITS: usize = 12;

fn main() -> io::Result<()> {
    shrink();
    let root = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let mut hash = Sha256::new();
    for source in SOURCES {
        println!("cargo::rerun-if-changed={source}");
        add(&mut hash, &root, Path::new(source))?;
    }
    println!("cargo::rerun-if-changed=Cargo.lock");
    // A library that is a dependency has none of its own.
    let lock = fs::read_to_string(root.join("Cargo.lock")).unwrap_or_default();
    for package in lock.split("[[package]]") {
        let value =
            |key: &str| package.lines().find_map(|line| line.strip_prefix(key)).unwrap_or_default().trim_matches('"');
        let (name, version) = (value("name = "), value("version = "));
        if CRATES.contains(&name) {
            hash.update(format!("{name} {version}\n"));
        }
    }
    let digits: String = hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    println!("cargo::rustc-env=SLIPSWEEP_REVISION={}", &digits[..DIGITS]);
    Ok(())
}

/// Adds the name and the code of a file, or of all files below a folder in the order of their names.
fn add(hash: &mut Sha256, root: &Path, source: &Path) -> io::Result<()> {
    let path = root.join(source);
    if path.is_dir() {
        let entries: io::Result<Vec<_>> =
            fs::read_dir(&path)?.map(|entry| entry.map(|entry| entry.file_name())).collect();
        let mut names = entries?;
        names.sort();
        return names.iter().try_for_each(|name| add(hash, root, &source.join(name)));
    }
    let text = fs::read_to_string(path)?;
    hash.update(source.to_string_lossy().replace('\\', "/"));
    // Unit tests are the last of a file.
    let code = text.lines().map(str::trim).take_while(|line| *line != "mod tests {");
    for line in code.filter(|line| !line.starts_with("//")) {
        hash.update(line);
        hash.update("\n");
    }
    Ok(())
}

/// Makes the program smaller: the linker merges equal functions, of which unoptimised generic code has many, and packs relocations. Not every
/// linker and C library can do that, so a small program is linked in this way and run first.
fn shrink() {
    const OPTIONS: [&str; 2] = ["-Wl,--icf=all", "-Wl,-z,pack-relative-relocs"];
    let (Some(rustc), Some(out)) = (env::var_os("RUSTC"), env::var_os("OUT_DIR")) else { return };
    let [source, linked] = ["linked.rs", "linked"].map(|name| Path::new(&out).join(name));
    let is_native = env::var_os("TARGET") == env::var_os("HOST");
    let is_release = env::var("PROFILE").is_ok_and(|profile| profile == "release");
    if !(is_native && is_release && fs::write(&source, "fn main() {}").is_ok()) {
        return;
    }
    let flags = env::var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default();
    let flags = flags.split('\u{1f}').filter(|flag| !flag.is_empty()).map(str::to_owned);
    let linker = env::var("RUSTC_LINKER").map(|linker| format!("-Clinker={linker}"));
    let options = OPTIONS.map(|option| format!("-Clink-arg={option}"));
    let mut compiler = Command::new(rustc);
    compiler.args(flags).args(linker).args(options).arg("-o").arg(&linked).arg(&source);
    let succeeds = |command: &mut Command| command.output().is_ok_and(|done| done.status.success());
    if succeeds(&mut compiler) && succeeds(&mut Command::new(&linked)) {
        OPTIONS.iter().for_each(|option| println!("cargo::rustc-link-arg-bins={option}"));
    }
}
