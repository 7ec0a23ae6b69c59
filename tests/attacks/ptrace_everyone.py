"""Attaches to every process that it can see.

Must: refused.
"""

from _tries import call, others, tries

for pid in others():
    for request in (16, 0x4206):  # attach, seize
        tries(f"ptrace {pid}", lambda pid=pid, request=request: call(101, request, pid, 0, 0))
    tries(f"process_vm_writev {pid}", lambda pid=pid: call(311, pid, bytes(16), 1, bytes(16), 1, 0))
    tries(f"kcmp {pid}", lambda pid=pid: call(312, pid, pid, 0, 0, 0))
print("done")
