"""What is compared: the workbench, and what others would do with the same cases. One method, one file."""

from collections.abc import Mapping

from discovery.challenge.methods.always_unexplained import always_unexplained
from discovery.challenge.methods.derivative_sindy import derivative_sindy
from discovery.challenge.methods.forward_selection import forward_selection
from discovery.challenge.methods.free_forcing_only import free_forcing_only
from discovery.challenge.methods.refit_only import refit_only
from discovery.challenge.methods.workbench import workbench
from discovery.challenge.problem import Method

WORKBENCH = "diagnosis"  # its answers are whole diagnosis.json files
METHODS: Mapping[str, Method] = {
    WORKBENCH: workbench,
    "refit_only": refit_only,
    "forward_selection": forward_selection,
    "derivative_sindy": derivative_sindy,
    "free_forcing": free_forcing_only,
    "always_unexplained": always_unexplained,
}
TITLES: Mapping[str, str] = {
    WORKBENCH: "workbench",
    "refit_only": "refit only",
    "forward_selection": "forward selection, white-noise BIC",
    "derivative_sindy": "derivative-residual SINDy",
    "free_forcing": "free forcing only",
    "always_unexplained": "always “unexplained”",
}

__all__ = ["METHODS", "TITLES", "WORKBENCH"]
