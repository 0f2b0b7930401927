//! The papers' tables and claims.

use crate::claims::{Claim, Verdict};
use crate::report::{Plot, PlotKind, Section};
use crate::steps::StepReport;
use crate::table::{Table, cube_lines, frame_lines, number, optional};
use crate::tables::TablesReport;

/// A section for the claims of each paper, then one for each table.
pub fn tables(report: &TablesReport) -> Vec<Section> {
    let short = |claims: &[Claim]| {
        claims
            .iter()
            .filter(|claim| claim.verdict == Verdict::Not)
            .count()
    };
    let method = format!(
        "Medians of {} runs, wall time, everything of ours rebuilt in every frame. HM08's figures are of one core of 2006, \
         VMV07's of one core of its time with a GeForce 8800 GTX, ours of the processor alone.",
        report.runs
    );
    let claims = |title: &str, claims: &[Claim]| {
        let missed = match short(claims) {
            0 => "None falls short.".to_owned(),
            1 => "One falls short.".to_owned(),
            short => format!("{short} fall short."),
        };
        let text = format!("{} claims. {missed}", claims.len());
        Section::new(title).text(text).list(verdicts(claims))
    };
    let [width, height] = report.size;
    let raster = &report.raster;
    let table_4 = format!(
        "{}: {} million triangles a second with {:.1} % of the window covered (paper: {}), {} million vertices a second out \
         of sight (paper: {}).",
        raster.scene,
        number(raster.mtriangles_per_s[0]),
        raster.covered * 100.0,
        raster.mtriangles_per_s[1],
        number(raster.mvertices_per_s[0]),
        raster.mvertices_per_s[1]
    );
    vec![
        claims("HM08, claims", &report.claims).text(method),
        claims("VMV07, claims", &report.cube_claims),
        Section::new(format!("HM08, Table 1, {width}x{height}"))
            .table("", frame_lines(report))
            .plot(table_1(report)),
        Section::new("HM08, Tables 2 and 3, square pictures").table("", tables_2_3(report)),
        Section::new("HM08, Table 4").text(table_4),
        steps(&report.steps),
        Section::new("VMV07, Table 1")
            .text(
                "A is the build of the cube, B its reflection rays and their hits, both in milliseconds of all threads; the \
                 paper's B has the rest of its frame too.",
            )
            .table("", cube_lines(report)),
    ]
}

fn verdicts(claims: &[Claim]) -> Vec<String> {
    let line = |claim: &Claim| {
        let verdict = match claim.verdict {
            Verdict::Exceeded => "exceeded",
            Verdict::Reproduced => "reproduced",
            Verdict::Not => "NOT",
            Verdict::NotMeasured => "not measured",
        };
        format!("{verdict}: {}: {}", claim.claim, claim.figures)
    };
    claims.iter().map(line).collect()
}

fn table_1(report: &TablesReport) -> Plot {
    let mut groups: Vec<(String, Vec<f64>)> = Vec::new();
    for line in &report.frames {
        if groups.last().is_none_or(|(scene, _)| *scene != line.scene) {
            groups.push((line.scene.clone(), Vec::new()));
        }
        if let Some((_, lengths)) = groups.last_mut() {
            lengths.push(line.mray_per_s);
        }
    }
    Plot {
        name: "table-1".into(),
        caption: "Million rays a second on one thread, builds included.".into(),
        kind: PlotKind::Bars {
            axis: "Mray/s".into(),
            series: ["eye", "eye+hard", "eye+soft8"].map(str::to_owned).to_vec(),
            groups,
            mark: Some(100.0),
        },
    }
}

fn tables_2_3(report: &TablesReport) -> Table {
    let mut table = Table::new(&[
        "scene",
        "frame",
        "fps",
        "x regular grid",
        "paper",
        "x hierarchy, rebuilt",
        "paper",
        "x hierarchy, prebuilt",
        "paper",
        "fastest hierarchy",
    ]);
    for line in &report.peers {
        let over = |other: Option<f64>| optional(other.map(|other| line.fps / other));
        let [grid, rebuilt, prebuilt] = line.paper_ratios.map(optional);
        table.row(vec![
            line.scene.clone(),
            line.frame.into(),
            number(line.fps),
            over(line.grid_fps),
            grid,
            over(line.rebuilt_fps),
            rebuilt,
            over(line.prebuilt_fps),
            prebuilt,
            line.fastest.clone().unwrap_or_else(|| "-".into()),
        ]);
    }
    table
}

fn steps(report: &StepReport) -> Section {
    let mut table = Table::new(&["grid", "cells", "cells a ray", "tests a ray", "references"]);
    for grid in &report.grids {
        let [x, y, z] = grid.cells;
        let kind = if grid.perspective {
            "perspective"
        } else {
            "regular"
        };
        table.row(vec![
            kind.into(),
            format!("{x}x{y}x{z}"),
            number(grid.steps),
            number(grid.tests),
            grid.references.to_string(),
        ]);
    }
    let rays = format!(
        "{}, {} shadow rays, {:.0} % of them in shadow; the paper has 52.0 and 12.7 cells a ray.",
        report.scene,
        report.rays,
        report.in_shadow * 100.0
    );
    Section::new("HM08, Table 5").text(rays).table("", table)
}
