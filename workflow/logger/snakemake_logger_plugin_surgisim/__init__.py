"""Snakemake's events as one JSON object a line, for `surgisim run` to follow."""

import json
import sys

from snakemake_interface_logger_plugins.base import LogHandlerBase

TOLD = ("jobid", "job_id", "job_ids", "jobs", "rule_name", "wildcards", "log", "reason", "done", "total", "stats")


class LogHandler(LogHandlerBase):
    writes_to_stream = True
    writes_to_file = False
    has_filter = True
    has_formatter = True
    needs_rulegraph = False

    def emit(self, record):
        said = {key: getattr(record, key) for key in TOLD if hasattr(record, key)}
        event = str(getattr(record, "event", None) or "")
        text = record.getMessage() if isinstance(record.msg, str) else ""
        print(json.dumps({"event": event, "level": record.levelname, "text": text} | said, default=str), flush=True)
        sys.stdout.flush()
