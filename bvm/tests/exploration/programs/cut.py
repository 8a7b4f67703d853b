"""Reads what a recording that was cut off still holds: prints the number of messages of each topic."""

import collections
import json
import sys

from mcap.stream_reader import StreamReader
from mcap.records import Channel, Message

topics, counts = {}, collections.Counter()
try:
    with open(sys.argv[1], "rb") as file:
        for record in StreamReader(file).records:
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            if isinstance(record, Message):
                counts[topics[record.channel_id]] += 1
except Exception:  # The end is missing.
    pass
print(json.dumps(counts))
