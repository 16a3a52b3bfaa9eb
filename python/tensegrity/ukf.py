"""The unscented Kalman filter with processes and measurements written in Python.

A filter of a state of dimension L has 2L+1 sigma points, the rows of an array (2L+1, L)::

    filter = UnscentedFilter(2, capacity=1)
    filter.set([0.0, 1.0], np.eye(2))
    filter.predict(lambda points: points @ F.T, noise)
    filter.correct(lambda points: points[:, :1], z=[0.2], variances=[0.01], gate=9.0)

Measurements come and go: any number of independent rows up to ``capacity`` at a time.
"""

from tensegrity._core import FilterForm, SigmaWeights, UnscentedFilter, UnscentedSettings

__all__ = ["FilterForm", "SigmaWeights", "UnscentedFilter", "UnscentedSettings"]
