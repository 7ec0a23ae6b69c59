"""What no file of this course names."""

from __future__ import annotations

import re

# In parts, so that this file does not name what it looks for.
HOSTS = "|".join(("pypi" + r"\.org", "python" + "hosted", "registry" + r"\.npm", "npm" + "js", "deb" + r"ian\.org"))


FOREIGN = re.compile(
    "|".join((HOSTS, "/" + r"work\b", "/" + r"root/\.", "/opt/" + "(pypi|wheels)", "shared" + "/design"))
)
