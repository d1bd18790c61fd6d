//! Packages, their description of the system that they need, and the sources of the documentation site.

#![cfg(target_os = "linux")]

use palpate::manual::TOPICS;
use palpate_device::serial::{ACCESS_RULE, MODEM_MANAGER_RULE};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap()
}

/// Runs a script of `.ci`.
fn script(name: &str, arguments: &[&Path]) -> std::io::Result<Output> {
    let output = Command::new(root().join(".ci").join(name)).args(arguments).output()?;
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    Ok(output)
}

#[test]
fn the_site_has_each_topic_once_and_all_pictures() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    script("book", &[folder.path()])?;
    let page = |name: &str| std::fs::read_to_string(folder.path().join("src").join(name));
    let summary = page("SUMMARY.md")?;
    let chapters: Vec<&str> =
        summary.lines().filter_map(|line| line.strip_prefix("- [")?.split_once("](").map(|(name, _)| name)).collect();
    let topics: Vec<&str> = TOPICS.iter().map(|topic| topic.name).collect();
    assert_eq!(chapters[..topics.len()], topics);
    for topic in TOPICS {
        let text = page(&format!("{}.md", topic.name))?;
        assert!(text.starts_with(&format!("# {}\n\n{}\n", topic.name, topic.summary())), "{}", topic.name);
    }
    assert!(page("accuracy.md")?.contains("![accuracy](assets/studies/accuracy.svg)"));
    let pictures = page("pictures.md")?;
    for picture in std::fs::read_dir(root().join("screenshots"))? {
        let picture = picture?.file_name().into_string().unwrap();
        assert!(!picture.ends_with(".png") || pictures.contains(&format!("(screenshots/{picture})")), "{picture}");
    }
    Ok(())
}

#[test]
fn a_link_that_leads_nowhere_fails_the_site() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let copy = folder.path().join("copy");
    let parts =
        ["README.md", "CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT", ".ci", "assets", "screenshots", "src/manual.rs"];
    std::fs::create_dir_all(copy.join("src"))?;
    for part in parts {
        let to = copy.join(part);
        assert!(Command::new("cp").arg("-R").arg(root().join(part)).arg(to).status()?.success());
    }
    std::fs::write(copy.join("CHANGELOG.md"), "[gone](assets/gone.png), `[code](x)`, [web](https://example.org)\n")?;
    let output = Command::new(copy.join(".ci/book")).arg(folder.path().join("book")).output()?;
    let told = String::from_utf8(output.stderr)?;
    assert!(!output.status.success() && told.ends_with("\n./CHANGELOG.md: assets/gone.png\n"), "{told}");
    Ok(())
}

/// Names of Debian packages in the list of what the window needs.
fn needed_by_the_window() -> Vec<String> {
    let text = read("src/app/startup.rs");
    let rows = text.split("needed(").skip(2);
    rows.filter_map(|row| row.split('"').nth(3)).map(str::to_owned).collect()
}

#[test]
fn the_package_depends_on_all_that_the_window_loads() {
    let needed = needed_by_the_window();
    assert!(needed.len() == 10 && needed.contains(&"mesa-vulkan-drivers".to_owned()), "{needed:?}");
    let control = read("assets/desktop/deb/control");
    let depends = control.lines().find_map(|line| line.strip_prefix("Depends: ")).unwrap();
    let depends: Vec<&str> = depends.split([',', '|']).map(|name| name.split_whitespace().next().unwrap()).collect();
    for package in needed {
        assert!(depends.contains(&&*package), "the package does not depend on {package}");
    }
}

#[test]
fn the_udev_rules_are_those_that_errors_name() {
    let rules = read("assets/desktop/70-palpate.rules");
    let rules: Vec<&str> = rules.lines().filter(|line| !line.starts_with('#')).collect();
    assert_eq!(rules, [ACCESS_RULE, MODEM_MANAGER_RULE]);
}

#[test]
fn the_action_draws_a_missing_picture_and_then_finds_it_the_same() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let programs = Path::new(env!("CARGO_BIN_EXE_palpate")).parent().unwrap();
    let path = format!("{}:{}", programs.display(), std::env::var("PATH")?);
    let golden = folder.path().join("golden.png");
    let compare = |object: &str| -> std::io::Result<(Option<i32>, String)> {
        let arguments = format!("{object} --size 200x150 --at 0.1 --bare");
        let mut command = Command::new(root().join(".github/actions/snapshot/compare"));
        command.arg(folder.path().join("new")).env("GOLDEN", &golden).env("ARGUMENTS", arguments);
        let output = command.env("TOLERANCE", "2").env("PIXELS", "0").env("PATH", &path).output()?;
        Ok((output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned()))
    };
    let (code, told) = compare("ball")?;
    assert!(code == Some(3) && told.contains("There is nothing to compare with"), "{code:?} {told}");
    std::fs::copy(folder.path().join("new/golden.png"), &golden)?;
    assert_eq!(compare("ball")?.0, Some(0));
    assert_eq!(compare("lemon")?.0, Some(1));
    assert_eq!(compare("lemon --nonsense")?.0, Some(2));
    // Signals beside it, and the one or the other alone.
    let signals = |object: &str| -> std::io::Result<(Option<i32>, String)> {
        let mut command = Command::new(root().join(".github/actions/snapshot/compare"));
        command.arg(folder.path().join("new")).env("SIGNALS", folder.path().join("golden.json")).env("GOLDEN", "");
        let output = command.env("ARGUMENTS", object).env("PATH", &path).output()?;
        Ok((output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned()))
    };
    let (code, told) = signals("ball")?;
    assert!(code == Some(3) && told.contains("There is nothing to compare with"), "{code:?} {told}");
    std::fs::copy(folder.path().join("new/golden.json"), folder.path().join("golden.json"))?;
    assert_eq!(signals("ball")?.0, Some(0));
    assert_eq!(signals("lemon")?.0, Some(1));
    Ok(())
}

/// Paths below the folder of an archive.
fn packed(archive: &Path) -> std::io::Result<Vec<PathBuf>> {
    let listed = Command::new("tar").arg("-tzf").arg(archive).output()?.stdout;
    let listed = String::from_utf8_lossy(&listed).into_owned();
    Ok(listed.lines().filter_map(|line| line.split_once('/')).map(|(_, rest)| PathBuf::from(rest)).collect())
}

#[test]
fn the_archive_has_program_and_desktop_files_and_its_bytes_repeat() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let program = folder.path().join("built");
    std::fs::write(&program, "GLIBC_2.4 GLIBC_2.17")?;
    let [first, again] = ["first", "again"].map(|name| folder.path().join(name));
    script("package", &[&program, &first])?;
    script("package", &[&program, &again])?;
    let name = format!("palpate-{}-linux-{}.tar.gz", env!("CARGO_PKG_VERSION"), std::env::consts::ARCH);
    let files = packed(&first.join(&name))?;
    for file in [
        "bin/palpate",
        "share/applications/palpate.desktop",
        "share/icons/hicolor/scalable/apps/palpate.svg",
        "share/icons/hicolor/48x48/apps/palpate.png",
        "share/mime/packages/palpate.xml",
        "lib/udev/rules.d/70-palpate.rules",
        "share/doc/palpate/LICENSE-MIT",
    ] {
        assert!(files.contains(&PathBuf::from(file)), "{file} is missing: {files:?}");
    }
    let sums = std::fs::read_to_string(first.join("SHA256SUMS"))?;
    assert!(sums.contains(&name) && sums == std::fs::read_to_string(again.join("SHA256SUMS"))?, "{sums}");
    Ok(())
}
