//! `slipsweep report`: a page that holds all it shows, and opens from disk in a browser without an error.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const SPEC: &str = r#"
name = "small"
description = "A page <of> its own"
[axes]
t_f = [0.02, 0.037]
v_f = 100.0
v_i = 3.0
b = 0.05
a = 0.03
alpha_2 = { linspace = [-0.3, 0.1, 21], unit = "1/t_f" }
alpha_3 = { linspace = [-0.3, 0.3, 21], unit = "1/t_f^2" }
[tables.gap]
[tables.best_cubic]
[tables.crossover]
"#;

fn command(folder: &Path, arguments: &[&str]) -> Output {
    let output =
        Command::new(env!("CARGO_BIN_EXE_slipsweep")).current_dir(folder).args(arguments).output().expect("runs");
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

#[test]
fn the_page_holds_everything_and_opens_without_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    fs::write(folder.join("small.toml"), SPEC).expect("is writable");
    command(folder, &["run", "small.toml"]);
    let said = command(folder, &["report", "results/small"]).stdout;
    assert_eq!(String::from_utf8_lossy(&said), "written to small-report.html\n");
    let page = fs::read_to_string(folder.join("small-report.html")).expect("is readable");
    for part in [
        "<h1>Dataset small</h1>",
        "<h2>Plan</h2>",
        "2 optimal protocols solved once each",
        "total: about ",
        "Rows and statuses",
        "<td>882</td>",
        "Pictures",
        "Summary",
        "A page &lt;of&gt; its own",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(page.contains("<th>t_f [l/v_0]</th>") && page.contains("<th>unit</th>"), "units");
    for table in ["gap: 882 rows", "best_cubic: 2 rows", "crossover: 1 row"] {
        assert_eq!(page.matches(table).count(), 1, "{table}");
    }
    // Two maps show their values; nothing is loaded from a network.
    assert_eq!(page.matches("\"column\":\"gap\"").count(), 2);
    assert!(!page.contains("src=") && !page.contains("<link") && !page.contains("@import") && !page.contains("fetch("));
    for out in ["page.pdf", "results/small/manifest.json", "results/small/gap/part-000000.parquet"] {
        let refused = Command::new(env!("CARGO_BIN_EXE_slipsweep"))
            .current_dir(folder)
            .args(["report", "results/small", "--out", out])
            .output()
            .expect("runs");
        assert_eq!(refused.status.code(), Some(1), "{out}");
    }
    command(folder, &["status", "results/small", "--check"]);
    command(folder, &["report", "results/small", "--out", "again.html"]);
    // The plan estimates from a sample that takes its time; the rest is the same again.
    let again = fs::read_to_string(folder.join("again.html")).expect("is readable");
    let but_the_plan = |page: &str| {
        let (before, after) = page.split_once("<h2>Plan</h2>").expect("has a plan");
        (before.to_owned(), after.split_once("<h2>Spec</h2>").expect("has a spec").1.to_owned())
    };
    assert_eq!(but_the_plan(&page), but_the_plan(&again));
    // The description on top, then pictures; each summary once.
    let order = [
        "<p>A page &lt;of&gt; its own</p>",
        "<h2>Pictures</h2>",
        "<h2>Rows and statuses</h2>",
        "<h2>Summary</h2>",
        "<h2>Plan</h2>",
    ];
    let places: Vec<Option<usize>> = order.iter().map(|part| page.find(part)).collect();
    assert!(places.iter().all(Option::is_some) && places.is_sorted(), "{places:?}");
    assert_eq!(page.matches("best_cubic: 2 rows").count(), 1);
    in_a_browser(folder);
}

/// What the script of the page does is seen in the document that Chromium has after sorting and pointing; errors go to its log.
fn in_a_browser(folder: &Path) {
    if Command::new("chromium").arg("--version").output().is_err() {
        eprintln!("SKIPPED: no chromium, so the page was not opened");
        return;
    }
    let page = fs::read_to_string(folder.join("small-report.html")).expect("is readable");
    // A user's hands: a click on a column, and the pointer in the middle of the first map.
    let hands = "<script>
document.querySelector('th').click();
const svg = document.querySelector('figure svg');
const [x, y, width, height] = JSON.parse(document.querySelector('figure script').textContent)[0].area;
const at = new DOMPoint(x + 0.3 * width, y + 0.5 * height).matrixTransform(svg.getScreenCTM());
svg.dispatchEvent(new MouseEvent('mousemove', { clientX: at.x, clientY: at.y, bubbles: true }));
</script></body>";
    fs::write(folder.join("used.html"), page.replace("</body>", hands)).expect("is writable");
    let address = format!("file://{}", folder.join("used.html").display());
    let profile = format!("--user-data-dir={}", folder.join("profile").display());
    let output = Command::new("chromium")
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"])
        .args([
            "--disable-component-update",
            "--disable-sync",
            "--enable-logging=stderr",
            &profile,
            "--dump-dom",
            &address,
        ])
        .output()
        .expect("runs");
    let (dom, log) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(!log.contains("CONSOLE"), "{log}");
    let tip = dom.split("<div id=\"tip\"").nth(1).and_then(|rest| rest.split("</div>").next()).unwrap_or_default();
    for part in ["alpha_2 = -0.18", "alpha_3 = ", "gap = "] {
        assert!(tip.contains(part), "{part} in {tip}");
    }
    let first = dom.split("<tbody>").nth(1).unwrap_or_default().trim_start();
    assert!(first.starts_with("<tr><td>best_cubic</td>"), "{}", first.chars().take(80).collect::<String>());
}
