"""Libraries of the package's extras, which an installation may lack."""

from importlib import import_module
from types import ModuleType

from orchestrator.errors import InputError


def imported(name: str, extra: str, where: str) -> ModuleType:
    """Import a library of an extra.

    Parameters
    ----------
    name
        The module.
    extra
        The extra that installs it.
    where
        The option, or the file and field, that needs it, for messages.

    Returns
    -------
    module
        The module.

    Raises
    ------
    InputError
        If it is not installed, with the name of the extra.
    """
    try:
        return import_module(name)
    except ImportError as error:
        what = f"it needs the extra [{extra}]: {error.name} is not installed"
        remedy = f"pip install 'orchestrator[{extra}]', with the Python that runs this"
        raise InputError(what, where, remedy) from None
