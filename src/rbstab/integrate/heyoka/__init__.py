"""The compiled engine; only this package imports heyoka."""
