"""Lay settings beside the notebook that Fast DDS reads from the working directory."""

from _neighbour import wait, work

PROFILE = """<?xml version="1.0"?><profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
<participant profile_name="mine" is_default_profile="true"><domainId>77</domainId></participant></profiles>"""
for one in ("FASTRTPS", "FASTDDS"):
    (work / f"DEFAULT_{one}_PROFILES.xml").write_text(PROFILE)
wait()
