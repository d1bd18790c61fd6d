"""CPU time of a training step and a live step of the macro-layer in PyTorch, on the sizes of `palpate bench training`.

    pip install torch
    python tests/peers/lstm_step.py
"""

import statistics
import time

import torch

torch.set_num_threads(1)
torch.set_flush_denormal(True)
STEPS, BATCH, UNITS, HIDDEN, CLASSES, RUNS = 300, 32, 128, 64, 16, 15


class MacroLayer(torch.nn.Module):
    def __init__(self, channels):
        super().__init__()
        self.lstm = torch.nn.LSTM(channels, UNITS, batch_first=True)
        self.first = torch.nn.Linear(UNITS, HIDDEN)
        self.dropout = torch.nn.Dropout(0.2)
        self.second = torch.nn.Linear(HIDDEN, CLASSES)
        with torch.no_grad():
            self.lstm.bias_ih_l0[UNITS : 2 * UNITS] += 1.0

    def forward(self, x, state=None):
        y, state = self.lstm(x, state)
        return self.second(self.dropout(torch.relu(self.first(y[:, -1])))), state


def timed(work, runs):
    times = []
    for run in range(runs + 2):
        start = time.process_time()
        work()
        if run >= 2:
            times.append((time.process_time() - start) * 1e3)
    return f"median {statistics.median(times):.3f} ms, least {min(times):.3f} ms"


print("torch", torch.__version__)
for channels in (4, 22):
    torch.manual_seed(1)
    net = MacroLayer(channels)
    optimiser = torch.optim.AdamW(net.parameters(), lr=1e-3)
    y = torch.arange(BATCH) % CLASSES
    x = (y[:, None, None] / 8.0 - 1.0) + torch.rand(BATCH, STEPS, channels) - 0.5

    def step():
        optimiser.zero_grad()
        torch.nn.functional.cross_entropy(net(x)[0], y).backward()
        optimiser.step()

    print(f"training step, {channels} channels: {timed(step, RUNS)}")

net.eval()
with torch.no_grad():
    state = None

    def live():
        global state
        scores, state = net(x[:1, :1], state)
        torch.softmax(scores, 1)

    print(f"live step: {timed(live, 300)}")
