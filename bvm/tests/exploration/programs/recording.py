"""Reads a recording with mcap-ros2-support, and prints what is in it as JSON."""

import json
import struct
import sys

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

found = {"topics": {}, "clouds": [], "gazes": [], "transforms": []}
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, decoder_factories=[DecoderFactory()])
    found["profile"] = reader.get_header().profile
    for schema, channel, message, decoded in reader.iter_decoded_messages():
        topic = found["topics"].setdefault(channel.topic, {"schema": schema.name, "count": 0})
        topic["count"] += 1
        stamped = decoded
        if channel.topic == "/tf":
            stamped = decoded.transforms[0]
            found["transforms"].append(
                [[one.header.frame_id, one.child_frame_id, one.transform.rotation.z, one.transform.rotation.w]
                 for one in decoded.transforms])
        if hasattr(stamped, "header"):
            stamp = stamped.header.stamp.sec * 10**9 + stamped.header.stamp.nanosec
            assert stamp == message.log_time == message.publish_time, (stamp, message.log_time)
            assert stamp > 0 and not stamped.header.frame_id.startswith("/")
        if channel.topic == "/map":
            # Extra fields are read by their names and offsets.
            offsets = {field.name: field.offset for field in decoded.fields}
            points = []
            for at in range(decoded.width * decoded.height):
                begin = at * decoded.point_step
                points.append([struct.unpack_from("<f", bytes(decoded.data), begin + offsets[name])[0]
                               for name in ("x", "y", "z", "occupancy")])
            assert decoded.row_step == decoded.point_step * decoded.width == len(decoded.data)
            found["clouds"].append({"dense": decoded.is_dense, "fields": sorted(offsets), "points": points})
        if channel.topic == "/gaze":
            turned = decoded.pose.orientation
            found["gazes"].append([turned.x, turned.y, turned.z, turned.w])
print(json.dumps(found))
