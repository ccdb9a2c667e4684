"""The exchange with a native code of the same model: what it is compared with."""

from orchestrator.benchmark.commands import COMMAND
from orchestrator.guests import Offer

OFFER = Offer(commands=(COMMAND,))
