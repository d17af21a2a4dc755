"""The compiled engine: everything that imports heyoka."""
