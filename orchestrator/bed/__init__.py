"""The bed: where its grains lie and which of them are exposed."""
