"""Bodies that swing, or hang far from their rest shape: each law by the engine's own runs, fitted and foretold."""
