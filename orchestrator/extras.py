"""Libraries of the package's extras, which an installation may lack."""

from importlib import import_module
from types import ModuleType

from orchestrator.errors import InputError

NEEDS = {"cluster": "dask-jobqueue>=0.9", "gis": "rasterio>=1.4"}
"""What `pip` installs for each extra: its library, which brings what that needs."""


def imported(name: str, extra: str, where: str) -> ModuleType:
    """Import a library of an extra.

    Parameters
    ----------
    name
        The module.
    extra
        The extra of the package that has it.
    where
        The option, or the file and field, that needs it, for messages.

    Returns
    -------
    module
        The module.

    Raises
    ------
    InputError
        If it is not installed, with what to install.
    """
    try:
        return import_module(name)
    except ImportError as error:
        what = f"it needs the extra [{extra}]: {error.name} is not installed"
        remedy = f"pip install '{NEEDS[extra]}', with the Python that runs this"
        raise InputError(what, where, remedy) from None
