"""Real recordings of which their makers know what a simulation would lack: one file each."""
