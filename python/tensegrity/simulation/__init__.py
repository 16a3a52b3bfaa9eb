"""The prism in MuJoCo: :func:`simulate` a manoeuvre and get its recording with the truth."""

from tensegrity.simulation.manoeuvres import Manoeuvre
from tensegrity.simulation.options import SimulationOptions
from tensegrity.simulation.simulate import simulate, simulate_with_forces

__all__ = ["Manoeuvre", "SimulationOptions", "simulate", "simulate_with_forces"]
