"""SUPERball in MuJoCo: :func:`simulate_superball` an experiment and get its recording with the
truth."""

from tensegrity.simulation.superball.motion import Experiment
from tensegrity.simulation.superball.options import SuperballOptions
from tensegrity.simulation.superball.simulate import simulate_superball

__all__ = ["Experiment", "SuperballOptions", "simulate_superball"]
