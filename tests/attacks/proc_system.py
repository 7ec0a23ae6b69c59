"""Changes settings of the kernel: core patterns, the next process id, namespaces, the network.

Must: refused.
"""

import os

from _tries import tries, write

NAMES = (
    "kernel/core_pattern kernel/ns_last_pid user/max_user_namespaces net/ipv4/ip_forward kernel/hostname vm/drop_caches"
)
for name in NAMES.split():
    tries(name, lambda path=f"/proc/sys/{name}": write(path))
for folder, _, files in os.walk("/proc/sys"):
    for name in files:
        path = os.path.join(folder, name)
        tries(path, lambda path=path: os.open(path, os.O_WRONLY))
for name in ("sysrq-trigger", "timer_list", "mtrr", "irq/0/smp_affinity", "latency_stats", "acpi/wakeup"):
    tries(name, lambda path=f"/proc/{name}": write(path))
print("done")
