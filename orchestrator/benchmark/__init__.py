"""The exchange with a native code of the same model: what it is compared with."""
