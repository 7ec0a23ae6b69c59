"""Listen in the multicast group in which the programs find each other."""

import socket
import time

from _neighbour import groups, ready

kept = []
ready()
while True:
    for one in groups() if len(kept) < 100 else ():
        kept.append(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        kept[-1].setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(one) + bytes(4))
    time.sleep(0.05)
