//! HM08's claims, held against what was measured.

use serde::Serialize;

use crate::FrameKind;
use crate::papers::TABLE_5;
use crate::steps::StepReport;
use crate::tables::{FrameLine, PeerLine, RasterLine};

/// What became of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Better than the paper says.
    Exceeded,
    /// As the paper says.
    Reproduced,
    /// Worse.
    Not,
    /// Not measured here.
    NotMeasured,
}

/// One claim.
#[derive(Clone, Debug, Serialize)]
pub struct Claim {
    /// What the paper says.
    pub claim: &'static str,
    /// What became of it.
    pub verdict: Verdict,
    /// The figures.
    pub figures: String,
}

/// What the claims are held against.
pub(crate) struct Evidence<'e> {
    /// Threads of the parallel figures.
    pub(crate) threads: usize,
    pub(crate) frames: &'e [FrameLine],
    pub(crate) peers: &'e [PeerLine],
    pub(crate) raster: &'e RasterLine,
    pub(crate) steps: &'e StepReport,
}

/// The smallest and the largest of some figures.
struct Range {
    least: f64,
    most: f64,
}

impl Range {
    fn of(figures: impl Iterator<Item = f64>) -> Self {
        let range = Self {
            least: f64::INFINITY,
            most: 0.0,
        };
        figures.fold(range, |range, figure| Self {
            least: range.least.min(figure),
            most: range.most.max(figure),
        })
    }

    fn times(&self) -> String {
        format!("{:.1} to {:.1} times", self.least, self.most)
    }

    fn percent(&self) -> String {
        format!("{:.0} to {:.0} %", self.least * 100.0, self.most * 100.0)
    }
}

pub(crate) fn claim(claim: &'static str, verdict: Verdict, figures: String) -> Claim {
    Claim {
        claim,
        verdict,
        figures,
    }
}

/// By how a figure compares with what is claimed; a tenth more or less is the same.
fn verdict(figure: f64, bar: f64) -> Verdict {
    match figure / bar {
        ratio if ratio >= 1.1 => Verdict::Exceeded,
        ratio if ratio >= 0.9 => Verdict::Reproduced,
        _ => Verdict::Not,
    }
}

impl<'e> Evidence<'e> {
    /// All claims, in the paper's order.
    pub(crate) fn claims(&self) -> Vec<Claim> {
        let [fps, rays] = self.rates();
        let [grid, hierarchy, mlrta, z_buffer, fastest] = self.beside_others();
        let [untested, steps, threads, build] = self.structure();
        let acne = claim(
            "no surface shadows itself, without an offset",
            Verdict::Reproduced,
            "every shadow ray equals exact arithmetic, by tests".into(),
        );
        vec![
            fps, rays, grid, hierarchy, mlrta, z_buffer, untested, steps, threads, build, acne, fastest,
        ]
    }

    fn of_kind(&self, kind: FrameKind) -> impl Iterator<Item = &'e FrameLine> + use<'e> {
        self.frames.iter().filter(move |line| line.frame == kind.name())
    }

    fn rates(&self) -> [Claim; 2] {
        let fps = |kind| {
            let line = self.of_kind(kind).find(|line| line.scene == "courtyard");
            line.map_or(0.0, |line| line.fps_parallel)
        };
        let (eye, hard) = (fps(FrameKind::Eye), fps(FrameKind::EyeHard));
        let scenes = self.of_kind(FrameKind::Eye).count();
        let fast = self
            .of_kind(FrameKind::Eye)
            .filter(|line| line.mray_per_s > 100.0);
        let fast = fast.count();
        [
            claim(
                "more than 130 frames a second of eye rays and 30 with hard shadows, Courtyard, 8 cores",
                verdict((eye / 130.0).min(hard / 30.0), 1.0),
                format!("{eye:.0} and {hard:.0} on {} threads", self.threads),
            ),
            claim(
                "more than 100 Mray/s of eye rays on a core in several scenes",
                verdict(fast as f64, 3.0),
                format!("in {fast} of {scenes} scenes"),
            ),
        ]
    }

    /// Our frames a second over those of others, of all kinds of frames or of one.
    fn over(&self, kind: Option<FrameKind>, fps: impl Fn(&PeerLine) -> Option<f64>) -> Range {
        let lines = self.peers.iter();
        let lines = lines.filter(|line| kind.is_none_or(|kind| line.frame == kind.name()));
        Range::of(lines.filter_map(|line| Some(line.fps / fps(line)?)))
    }

    fn beside_others(&self) -> [Claim; 5] {
        let grid = self.over(None, |line| line.grid_fps);
        let rebuilt = |kind| self.over(Some(kind), |line| line.rebuilt_fps);
        let (eye, hard) = (rebuilt(FrameKind::Eye), rebuilt(FrameKind::EyeHard));
        let prebuilt = |kind| self.over(Some(kind), |line| line.prebuilt_fps);
        let (eye_prebuilt, hard_prebuilt) = (prebuilt(FrameKind::Eye), prebuilt(FrameKind::EyeHard));
        let [triangles, paper] = self.raster.mtriangles_per_s;
        let vertices = self.raster.mvertices_per_s[0];
        [
            claim(
                "4.6 to 5.0 times a regular grid whose build is not counted",
                verdict(grid.least, 4.6),
                format!("{} our own, which is exact and not made for speed", grid.times()),
            ),
            claim(
                "1.4 to 2.8 times a hierarchy with its refit, eye rays; 0.9 to 2.4 times with hard shadows",
                verdict((eye.least / 1.37).min(hard.least / 0.94), 1.0),
                format!("{} and {} the fastest, rebuilt", eye.times(), hard.times()),
            ),
            claim(
                "at least as fast as MLRTA on static scenes",
                Verdict::NotMeasured,
                format!(
                    "there is no library of it; {} the fastest prebuilt hierarchy, eye rays",
                    eye_prebuilt.times()
                ),
            ),
            claim(
                "eye rays on par with a software Z-buffer",
                verdict(triangles, paper),
                format!(
                    "{triangles:.1} million triangles and {vertices:.1} million vertices a second; the paper's Z-buffer of \
                     2006 had 7.9 and 35"
                ),
            ),
            claim(
                "the fastest hard shadows on a core that were known",
                verdict(hard_prebuilt.least, 1.0),
                format!(
                    "{} the fastest library found here, prebuilt",
                    hard_prebuilt.times()
                ),
            ),
        ]
    }

    fn structure(&self) -> [Claim; 4] {
        let untested = Range::of(self.frames.iter().filter_map(|line| line.untested)).most;
        let efficiency = self.frames.iter();
        let efficiency = Range::of(efficiency.map(|line| line.fps_parallel / line.fps / self.threads as f64));
        let large = self
            .of_kind(FrameKind::Eye)
            .filter(|line| line.triangles > 100_000);
        let build = Range::of(large.map(|line| line.build));
        let soft = Range::of(self.of_kind(FrameKind::EyeSoft).map(|line| line.build));
        let ratio = self.steps.ratio();
        [
            claim(
                "up to 90 % of the lit shadow rays need no test of a triangle",
                verdict(untested, 0.9),
                format!("up to {:.0} % of all shadow rays", untested * 100.0),
            ),
            claim(
                "soft shadow rays take less than a third of the steps of a regular grid",
                verdict(1.0 / 3.0, ratio),
                format!(
                    "{ratio:.2} of them; the paper's table has {:.2}",
                    TABLE_5[1] / TABLE_5[0]
                ),
            ),
            claim(
                "90 % parallel efficiency of traversal on 8 cores",
                verdict(efficiency.least, 0.9),
                format!(
                    "{} of whole frames, builds included, on {} threads",
                    efficiency.percent(),
                    self.threads
                ),
            ),
            claim(
                "the build takes 10 to 50 % of a frame with more than 100k triangles, next to nothing with soft shadows",
                verdict(0.5, build.most),
                format!(
                    "{} with eye rays, {} with soft shadows",
                    build.percent(),
                    soft.percent()
                ),
            ),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenth_more_or_less_is_the_same() {
        let verdicts = [1.2, 1.0, 0.95, 0.8].map(|figure| verdict(figure, 1.0));
        let expected = [
            Verdict::Exceeded,
            Verdict::Reproduced,
            Verdict::Reproduced,
            Verdict::Not,
        ];
        assert_eq!(verdicts, expected);
    }
}
