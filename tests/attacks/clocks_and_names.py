"""Sets the clock, the host's name, keys, quotas and accounting.

Must: refused.
"""

from _tries import call, tries

for name, number in {
    "settimeofday": 164, "clock_settime": 227, "adjtimex": 159, "sethostname": 170, "setdomainname": 171, "acct": 163,
    "swapon": 167, "reboot": 169, "quotactl": 179, "add_key": 248, "keyctl": 250, "init_module": 175,
    "kexec_load": 246, "iopl": 172, "personality": 135, "fanotify_init": 300,
}.items():  # fmt: skip
    tries(name, lambda number=number: call(number, b"student", 4, 0, 0, 0))
print("done")
