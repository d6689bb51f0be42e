//! Converts parsed arguments to requests.

use std::path::{Path, PathBuf};

use dgd_work::{
    AdoptRequest, DiscoverRequest, JournalChoice, RunRequest, SensitivityRequest, SimulateRequest,
    SolverOptions, TrackRequest,
};

use super::{
    AdoptArgs, ChoiceArgs, DiscoverArgs, FreeArgs, RecordingArgs, RunArgs, SensitivityArgs,
    SimulateArgs, SolveArgs, StartArg, TrackArgs, TrackerArg,
};
use crate::command_line::command_line;

impl ChoiceArgs {
    /// The choices as part of a request.
    pub(crate) fn request(&self) -> dgd_work::ModelChoices {
        dgd_work::ModelChoices::new(self.variant.clone(), self.set.clone(), self.apply.clone())
    }
}

impl FreeArgs {
    /// The estimates as part of a request.
    pub(crate) fn request(&self) -> dgd_work::FreeParameters {
        dgd_work::FreeParameters::new(self.free.clone(), self.fix.clone())
    }
}

impl RecordingArgs {
    /// All recordings, validation last.
    pub(crate) fn all(&self) -> impl Iterator<Item = &PathBuf> {
        self.data.iter().chain(&self.valid)
    }

    /// The journal, beside `out`.
    pub(crate) fn keep(&self, out: Option<&Path>) -> JournalChoice {
        JournalChoice::new(out.map(Path::to_owned), self.resume)
    }
}

impl From<StartArg> for dgd_work::StartChoice {
    fn from(start: StartArg) -> Self {
        match start {
            // A steady start is a choice of the model.
            StartArg::Model | StartArg::Steady => dgd_work::StartChoice::Model,
            StartArg::Measured => dgd_work::StartChoice::Measured,
        }
    }
}

impl SolveArgs {
    /// The choices, including a steady start.
    pub(super) fn choices(&self, choices: &ChoiceArgs) -> dgd_work::ModelChoices {
        let mut choices = choices.request();
        choices.at_rest = self.start == StartArg::Steady;
        choices
    }

    /// The simulation settings as part of a request.
    pub(crate) fn request(&self) -> SolverOptions {
        let mut solve = SolverOptions::default();
        solve.start = self.start.into();
        solve.rename.clone_from(&self.rename);
        solve.from = self.from;
        solve.until = self.until;
        solve.method.clone_from(&self.method);
        solve.steps = self.steps;
        solve.rtol = self.rtol;
        solve.atol = self.atol;
        solve.engine = self.engine.into();
        solve
    }
}

impl RunArgs {
    /// The request of a run.
    pub(crate) fn request(&self) -> RunRequest {
        let mut run = RunRequest::new(&self.model);
        run.choices = self.solve.choices(&self.choices);
        run.data.clone_from(&self.data);
        run.every = self.every;
        run.solve = self.solve.request();
        run
    }
}

impl SimulateArgs {
    /// The request of a simulation.
    pub(crate) fn request(&self) -> SimulateRequest {
        let mut request = SimulateRequest::new(self.run.request());
        request.ensemble.clone_from(&self.ensemble);
        request.over.clone_from(&self.over);
        request.labels.clone_from(&self.label);
        request.marks.clone_from(&self.mark);
        request.noise_seed = self.noise_seed;
        request.fields = !self.run.solve.plot.is_empty();
        request
    }
}

impl SensitivityArgs {
    /// The request of sensitivities.
    pub(crate) fn request(&self) -> SensitivityRequest {
        let mut request = SensitivityRequest::new(self.run.request());
        request.of.clone_from(&self.of);
        request.to.clone_from(&self.to);
        request.scaled = self.scaled;
        request.verify_sensitivities = self.verify_sensitivities;
        request
    }
}

impl DiscoverArgs {
    /// The request of a discovery; its journal is kept beside `out`.
    pub(crate) fn request(&self, out: Option<&Path>) -> DiscoverRequest {
        let mut request = DiscoverRequest::new(&self.model, self.given.data.clone());
        request.choices = self.solve.choices(&self.choices);
        request.valid.clone_from(&self.given.valid);
        request.effects.clone_from(&self.effects);
        request.budget = self.budget;
        request.sought = self.given.sought.request();
        request.keep = self.given.keep(out);
        request.solve = self.solve.request();
        request.command = command_line();
        request
    }
}

impl AdoptArgs {
    /// The request of an adoption.
    pub(crate) fn request(&self) -> AdoptRequest {
        AdoptRequest::new(&self.result, &self.name)
    }
}

impl TrackArgs {
    /// The request of a tracking run.
    pub(crate) fn request(&self) -> TrackRequest {
        let mut request = TrackRequest::new(&self.model, &self.data);
        request.choices = self.solve.choices(&self.choices);
        request.estimator = match self.estimator {
            TrackerArg::Ekf => dgd_work::TrackerKind::Ekf,
            TrackerArg::Ukf => dgd_work::TrackerKind::Ukf,
            TrackerArg::Recursive => dgd_work::TrackerKind::Recursive,
        };
        request.sought = self.sought.request();
        request.outputs.clone_from(&self.outputs);
        request.process_noise.clone_from(&self.process_noise);
        request.start_std.clone_from(&self.start_std);
        request.noise.clone_from(&self.noise);
        request.forgetting = self.forgetting;
        request.strict = self.strict;
        request.gate = self.gate;
        request.solve = self.solve.request();
        request.keeps_rows = !self.solve.plot.is_empty();
        request
    }
}
