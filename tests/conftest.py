"""What every test shares: threads that wait their turn instead of spinning for it."""

import os

# Before torch is imported anywhere: on a busy machine its idle threads would keep both cores from working.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
