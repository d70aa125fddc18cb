"""The page where the firmware runs: simulated chip, world as WebAssembly, telemetry live."""
